"""Making the generated recording: once, whole or not at all, the same bytes every time."""


def test_fixture(demo_recording):
    assert demo_recording.folder.is_dir()
    assert len(demo_recording.image_names) == 9
    assert (demo_recording.px_visible[-1] == 0).all()
