import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ars_web.errors import BadFile, BadInput, RefusedPath
from ars_web.geometry.camera import Camera
from ars_web.recordings.colmap_model import MODEL_PARAMS
from ars_web.recordings.registry import ReadOptions, read_recording

W, H = 64, 48
PINHOLE = (60.0, 61.0, 32.5, 24.5)


def spelled(values: object) -> str:
    return " ".join(repr(float(value)) for value in np.ravel(values))


class Rig:
    """Two cameras on one rig, three instants; the model's own image poses are wrong on purpose, as only the frames
    count in a model that has them."""

    def __init__(self, folder: Path, random_pose: Callable, colmap_pose: Callable, image_writer: Callable) -> None:
        rng = np.random.default_rng(11)
        self.folder, self.row = folder, colmap_pose
        self.model = folder / "sparse"
        self.model.mkdir()
        self.T_second_rig = random_pose(rng)
        self.Ts_rig_world = [random_pose(rng) for _ in range(3)]
        self.names = [f"{camera}/{i}.png" for camera in ("left", "right") for i in range(3)]
        for name in self.names:
            image_writer(folder / "images" / name)
        self.truth = np.array(
            [np.linalg.inv(T) for T in self.Ts_rig_world]
            + [np.linalg.inv(self.T_second_rig @ T) for T in self.Ts_rig_world]
        )

    def ids(self, i: int) -> tuple[int, int]:
        return 10 + 2 * i, 11 + 2 * i

    def text(self, *, second: str | None = None, frames: str | None = None) -> Path:
        (self.model / "cameras.txt").write_text(
            f"3 PINHOLE {W} {H} {spelled(PINHOLE)}\n5 OPENCV_FISHEYE {W} {H} {spelled(PINHOLE)} 0.1 0.2 0.3 0.4\n"
        )
        lines = []
        for i in range(3):
            for image_id, camera, folder in zip(self.ids(i), (3, 5), ("left", "right"), strict=True):
                lines += [f"{image_id} 1 0 0 0 0 0 0 {camera} {folder}/{i}.png", "1 2 -1"]
        (self.model / "images.txt").write_text("\n".join(lines) + "\n")
        mounted = f"1 {spelled(self.row(self.T_second_rig))}" if second is None else second
        (self.model / "rigs.txt").write_text(f"# rigs\n9 3 CAMERA 3 IMU 1 0 CAMERA 5 {mounted}\n")
        written = [
            f"{i} 9 {spelled(self.row(T))} 3 CAMERA 3 {a} IMU 1 {a} CAMERA 5 {b}"
            for i, T in enumerate(self.Ts_rig_world, 1)
            for a, b in [self.ids(i - 1)]
        ]
        (self.model / "frames.txt").write_text("\n".join(written) if frames is None else frames)
        return self.folder

    def binary(self) -> Path:
        cameras = struct.pack("<Q", 2) + struct.pack("<IiQQ4d", 3, 1, W, H, *PINHOLE)
        cameras += struct.pack("<IiQQ8d", 5, 5, W, H, *PINHOLE, 0.1, 0.2, 0.3, 0.4)
        (self.model / "cameras.bin").write_bytes(cameras)
        images = struct.pack("<Q", 6)
        for i in range(3):
            for image_id, camera, folder in zip(self.ids(i), (3, 5), ("left", "right"), strict=True):
                images += struct.pack("<I7dI", image_id, 1, 0, 0, 0, 0, 0, 0, camera)
                images += f"{folder}/{i}.png".encode() + b"\0" + struct.pack("<Qddq", 1, 1.0, 2.0, -1)
        (self.model / "images.bin").write_bytes(images)
        rigs = struct.pack("<QII", 1, 9, 3) + struct.pack("<iI", 0, 3) + struct.pack("<iIB", 1, 1, 0)
        rigs += struct.pack("<iIB7d", 0, 5, 1, *self.row(self.T_second_rig))
        (self.model / "rigs.bin").write_bytes(rigs)
        frames = struct.pack("<Q", 3)
        for i, T in enumerate(self.Ts_rig_world):
            a, b = self.ids(i)
            frames += struct.pack("<II7dI", i + 1, 9, *self.row(T), 3)
            frames += struct.pack("<iIQ", 0, 3, a) + struct.pack("<iIQ", 1, 1, a) + struct.pack("<iIQ", 0, 5, b)
        (self.model / "frames.bin").write_bytes(frames)
        return self.folder


@pytest.fixture
def rig(tmp_path: Path, random_pose: Callable, colmap_pose: Callable, image_writer: Callable) -> Rig:
    return Rig(tmp_path, random_pose, colmap_pose, image_writer)


@pytest.mark.parametrize("kind", ["text", "binary"])
def test_rigs(rig: Rig, kind: str) -> None:
    recording = read_recording(getattr(rig, kind)())
    assert [frame.name for frame in recording.frames] == rig.names
    np.testing.assert_allclose(recording.Ts_world_camera, rig.truth, atol=1e-9)
    assert [frame.camera_id for frame in recording.frames] == [0, 0, 0, 1, 1, 1]
    assert recording.cameras == {
        0: Camera(W, H, 60.0, 61.0, 32.0, 24.0),
        1: Camera(W, H, 60.0, 61.0, 32.0, 24.0, "fisheye", (0.1, 0.2, 0.3, 0.4)),
    }


def test_binary_comes_before_text(rig: Rig) -> None:
    rig.binary()
    rig.text(frames="1 9 damaged")
    np.testing.assert_allclose(read_recording(rig.folder).Ts_world_camera, rig.truth, atol=1e-9)


def test_a_camera_that_the_rig_has_no_pose_for(rig: Rig) -> None:
    recording = read_recording(rig.text(second="0"))
    assert [frame.name for frame in recording.frames] == rig.names[:3]
    np.testing.assert_allclose(recording.Ts_world_camera, rig.truth[:3], atol=1e-9)
    assert [one.name for one in recording.skipped] == rig.names[3:]
    assert "rig 9 has no pose for camera 5" in recording.skipped[0].reason


def test_a_rig_that_is_not_rigid(rig: Rig) -> None:
    recording = read_recording(rig.text(second="1 2 0 0 0 0 0 0"))
    assert len(recording.frames) == 3
    assert "length 2, not 1" in recording.skipped[0].reason


def test_images_in_no_frame(rig: Rig) -> None:
    rig.text()
    lines = (rig.model / "frames.txt").read_text().splitlines()
    (rig.model / "frames.txt").write_text("\n".join([*lines[:2], "3 9 1 0 0 0 0 0 0 1 CAMERA 3 999"]))
    recording = read_recording(rig.folder)
    assert [one.name for one in recording.skipped] == ["left/2.png", "right/2.png"]
    assert "in no frame" in recording.skipped[0].reason


@pytest.mark.parametrize(
    ("frames", "message"),
    [
        ("1 8 1 0 0 0 0 0 0 0", r"frames\.txt:1: frame 1 is of rig 8, which the model does not have"),
        ("1 9 1 0 0 0 0 0 0 1 CAMERA 4 10", r"frames\.txt:1: frame 1 has camera 4, which rig 9 does not"),
        ("1 9 1 0 0 0 0 0 0 1 CAMERA 5 10", r"frame 1 says that image 10 is of camera 5, .*txt:1 that it is of 3"),
        ("1 9 1 0 0 0 0 0 0 2 CAMERA 3 10 CAMERA 3 10", r"image 10 is in two frames"),
        ("1 9 1 0 0 0 0 0 0 2 CAMERA 3 10", r"frames\.txt:1: the frame ends after 13 words"),
        ("1 9 1 0 0 0 0 0 0 0 5", r"frames\.txt:1: the frame has 11 words, 10 are expected"),
        ("1 9 1 0 0 0 0 0 0 1 LIDAR 3 10", r"frames\.txt:1: sensor type 'LIDAR' is unknown"),
        ("1.5 9", r"frames\.txt:1: '1.5' is not a whole number"),
        ("1 9 1 0 0 x 0 0 0 0", r"frames\.txt:1: among '1 0 0 x 0 0 0' is something that is no number"),
    ],
)
def test_damaged_frames_are_named(rig: Rig, frames: str, message: str) -> None:
    with pytest.raises(BadInput, match=message):
        read_recording(rig.text(frames=frames))


@pytest.mark.parametrize("name", ["rigs", "frames"])
def test_rigs_and_frames_come_together(rig: Rig, name: str) -> None:
    rig.text()
    (rig.model / f"{name}.txt").unlink()
    with pytest.raises(BadFile, match=rf"{name}\.txt: is missing"):
        read_recording(rig.folder)


@pytest.mark.parametrize("name", ["cameras", "images", "rigs", "frames"])
@pytest.mark.parametrize("cut", [-1, 0.5, 9, 0])
def test_truncated_binary_files_are_named(rig: Rig, name: str, cut: float) -> None:
    rig.binary()
    file = rig.model / f"{name}.bin"
    data = file.read_bytes()
    file.write_bytes(data[: int(len(data) * cut) if cut == 0.5 else int(cut)])
    with pytest.raises(BadFile, match=rf"{name}\.bin: (ends at byte|says that it holds|is empty)"):
        read_recording(rig.folder)


@pytest.mark.parametrize("name", ["cameras", "images", "rigs", "frames"])
def test_binary_files_with_too_much_are_named(rig: Rig, name: str) -> None:
    rig.binary()
    with (rig.model / f"{name}.bin").open("ab") as file:
        file.write(bytes(5))
    with pytest.raises(BadFile, match=rf"{name}\.bin: has 5 bytes after its last record"):
        read_recording(rig.folder)


@pytest.mark.parametrize("place", [8, 12])
def test_a_count_of_points_beyond_the_file(rig: Rig, place: int) -> None:
    rig.binary()
    file = rig.model / "images.bin"
    data = bytearray(file.read_bytes())
    at = data.index(b"\0", data.index(b"left/0.png")) + 1
    data[at : at + 8] = struct.pack("<Q", 1 << 60)
    file.write_bytes(bytes(data))
    with pytest.raises(BadFile, match=r"images\.bin: ends at byte"):
        read_recording(rig.folder)


CAMERAS = {
    "SIMPLE_PINHOLE": ((60.0, 32.5, 24.5), Camera(W, H, 60.0, 60.0, 32.0, 24.0)),
    "PINHOLE": (PINHOLE, Camera(W, H, 60.0, 61.0, 32.0, 24.0)),
    "SIMPLE_RADIAL": (
        (60.0, 32.5, 24.5, 0.1),
        Camera(W, H, 60.0, 60.0, 32.0, 24.0, "brown", (0.1, 0.0, 0.0, 0.0, 0.0)),
    ),
    "RADIAL": (
        (60.0, 32.5, 24.5, 0.1, 0.2),
        Camera(W, H, 60.0, 60.0, 32.0, 24.0, "brown", (0.1, 0.2, 0.0, 0.0, 0.0)),
    ),
    "OPENCV": (
        (*PINHOLE, 0.1, 0.2, 0.3, 0.4),
        Camera(W, H, 60.0, 61.0, 32.0, 24.0, "brown", (0.1, 0.2, 0.3, 0.4, 0.0)),
    ),
    "FULL_OPENCV": (
        (*PINHOLE, 0.1, 0.2, 0.3, 0.4, 0.5, 0.0, 0.0, 0.0),
        Camera(W, H, 60.0, 61.0, 32.0, 24.0, "brown", (0.1, 0.2, 0.3, 0.4, 0.5)),
    ),
    "OPENCV_FISHEYE": (
        (*PINHOLE, 0.1, 0.2, 0.3, 0.4),
        Camera(W, H, 60.0, 61.0, 32.0, 24.0, "fisheye", (0.1, 0.2, 0.3, 0.4)),
    ),
    "SIMPLE_RADIAL_FISHEYE": (
        (60.0, 32.5, 24.5, 0.1),
        Camera(W, H, 60.0, 60.0, 32.0, 24.0, "fisheye", (0.1, 0.0, 0.0, 0.0)),
    ),
    "RADIAL_FISHEYE": (
        (60.0, 32.5, 24.5, 0.1, 0.2),
        Camera(W, H, 60.0, 60.0, 32.0, 24.0, "fisheye", (0.1, 0.2, 0.0, 0.0)),
    ),
    "SIMPLE_FISHEYE": ((60.0, 32.5, 24.5), Camera(W, H, 60.0, 60.0, 32.0, 24.0, "fisheye", (0.0, 0.0, 0.0, 0.0))),
    "FISHEYE": (PINHOLE, Camera(W, H, 60.0, 61.0, 32.0, 24.0, "fisheye", (0.0, 0.0, 0.0, 0.0))),
}


def one_image(folder: Path, image_writer: Callable, model: str, params: tuple[float, ...], *, binary: bool) -> Path:
    image_writer(folder / "images" / "a.png")
    if binary:
        number = list(MODEL_PARAMS).index(model)
        data = struct.pack(f"<QIiQQ{len(params)}d", 1, 1, number, W, H, *params)
        (folder / "cameras.bin").write_bytes(data)
        data = struct.pack("<QI7dI", 1, 1, 1, 0, 0, 0, 0, 0, 0, 1) + b"a.png\0" + bytes(8)
        (folder / "images.bin").write_bytes(data)
    else:
        (folder / "cameras.txt").write_text(f"1 {model} {W} {H} {spelled(params)}\n")
        (folder / "images.txt").write_text("1 1 0 0 0 0 0 0 1 a.png\n\n")
    return folder


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("model", CAMERAS)
def test_camera_models_that_ours_express(tmp_path: Path, image_writer: Callable, model: str, binary: bool) -> None:
    params, camera = CAMERAS[model]
    assert read_recording(one_image(tmp_path, image_writer, model, params, binary=binary)).cameras == {0: camera}


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("model", [model for model in MODEL_PARAMS if model not in CAMERAS])
def test_camera_models_that_ours_do_not(tmp_path: Path, image_writer: Callable, model: str, binary: bool) -> None:
    params = tuple(0.5 for _ in MODEL_PARAMS[model])
    with pytest.raises(BadInput, match=rf"camera 1 is a {model}, which cannot be expressed exactly; undistort"):
        read_recording(one_image(tmp_path, image_writer, model, params, binary=binary))


def test_full_opencv_with_a_denominator(tmp_path: Path, image_writer: Callable) -> None:
    params = (*PINHOLE, 0.1, 0.2, 0.3, 0.4, 0.5, 0.0, 0.25, 0.0)
    with pytest.raises(BadInput, match=r"cameras\.txt:1: camera 1 is a FULL_OPENCV with k5 0\.25, which cannot"):
        read_recording(one_image(tmp_path, image_writer, "FULL_OPENCV", params, binary=False))


def test_a_camera_model_that_is_not_used_does_no_harm(tmp_path: Path, image_writer: Callable) -> None:
    folder = one_image(tmp_path, image_writer, "PINHOLE", PINHOLE, binary=False)
    with (folder / "cameras.txt").open("a") as file:
        file.write(f"2 FOV {W} {H} 1 1 1 1 1\n")
    assert list(read_recording(folder).cameras) == [0]


@pytest.mark.parametrize(
    ("file", "text", "message"),
    [
        ("cameras.txt", "1 FISH 64 48 1", r"cameras\.txt:1: camera model 'FISH' is unknown; known are SIMPLE_PINHOLE"),
        ("cameras.txt", "# c\n1 PINHOLE 64 48 1 1 1", r"cameras\.txt:2: the camera ends after 7 words"),
        ("cameras.txt", "1 PINHOLE 64 48 1 1 1 1 1", r"cameras\.txt:1: the camera has 9 words, 8 are expected"),
        ("cameras.txt", "1 PINHOLE 64 48 -1 1 1 1", r"cameras\.txt:1: camera 1: focal lengths must be positive"),
        ("cameras.txt", "1 PINHOLE 0 48 1 1 1 1", r"cameras\.txt:1: camera 1: a camera's image must be"),
        ("cameras.txt", "2 PINHOLE 64 48 1 1 1 1", r"images\.txt:1: a\.png is of camera 1, which the model does not"),
        ("cameras.txt", "1 PINHOLE 64 48 1 1 1 1\n" * 2, r"cameras\.txt: has camera 1 twice"),
        ("images.txt", "", r"images\.txt: lists no image"),
        ("images.txt", "1 1 0 0 0 0 0 0 1", r"images\.txt:1: the image ends after 9 words"),
        ("images.txt", "1 1 0 0 0 0 0 0 1 a.png\n\n" * 2, r"images\.txt: has image 1 twice"),
        (
            "images.txt",
            "1 1 0 0 0 0 0 0 1 a.png\n2 1 0 0 0 0 0 0 1 b.png\n",
            r"images\.txt:2: is no line of 2D points",
        ),
        (
            "images.txt",
            "1 1 0 0 0 0 0 0 1 a.png\n\n2 1 0 0 0 0 0 0 1 a.png\n\n",
            r"lists a\.png twice, in .*images\.txt:1 and in .*images\.txt:3",
        ),
    ],
)
def test_damaged_text_files_are_named(
    tmp_path: Path, image_writer: Callable, file: str, text: str, message: str
) -> None:
    folder = one_image(tmp_path, image_writer, "PINHOLE", PINHOLE, binary=False)
    (folder / file).write_text(text)
    with pytest.raises(BadInput, match=message):
        read_recording(folder)


@pytest.mark.parametrize(
    ("pose", "reason"),
    [
        ("nan 0 0 0 0 0 0", "quaternion is not finite"),
        ("2 0 0 0 0 0 0", "length 2"),
        ("1 0 0 0 inf 0 0", "position inf"),
    ],
)
def test_a_bad_pose_is_skipped(tmp_path: Path, image_writer: Callable, pose: str, reason: str) -> None:
    folder = one_image(tmp_path, image_writer, "PINHOLE", PINHOLE, binary=False)
    image_writer(folder / "images" / "b.png")
    (folder / "images.txt").write_text(f"1 1 0 0 0 0 0 0 1 a.png\n\n2 {pose} 1 b.png\n\n")
    (skipped,) = read_recording(folder).skipped
    assert (skipped.name, skipped.where) == ("b.png", f"{folder / 'images.txt'}:3")
    assert reason in skipped.reason


def test_a_binary_name_that_is_not_utf8(tmp_path: Path, image_writer: Callable) -> None:
    folder = one_image(tmp_path, image_writer, "PINHOLE", PINHOLE, binary=True)
    data = (folder / "images.bin").read_bytes().replace(b"a.png", b"\xff.png")
    (folder / "images.bin").write_bytes(data)
    with pytest.raises(BadFile, match=r"images\.bin: an image's name .* is not UTF-8"):
        read_recording(folder)


def test_a_model_number_of_the_future(tmp_path: Path, image_writer: Callable) -> None:
    folder = one_image(tmp_path, image_writer, "PINHOLE", PINHOLE, binary=True)
    (folder / "cameras.bin").write_bytes(struct.pack("<QIiQQ4d", 1, 1, 99, W, H, *PINHOLE))
    with pytest.raises(BadFile, match=r"cameras\.bin: camera 1 is of model number 99, which is unknown"):
        read_recording(folder)


def test_a_name_with_spaces_and_crlf(tmp_path: Path, image_writer: Callable) -> None:
    folder = one_image(tmp_path, image_writer, "PINHOLE", PINHOLE, binary=False)
    image_writer(folder / "images" / "my photo.png")
    (folder / "images.txt").write_bytes(b"\xef\xbb\xbf# c\r\n1 1 0 0 0 0 0 0 1 my photo.png\r\n\r\n")
    recording = read_recording(folder)
    assert [frame.name for frame in recording.frames] == ["my photo.png"]


def test_images_without_a_pose_are_listed(tmp_path: Path, image_writer: Callable) -> None:
    folder = one_image(tmp_path, image_writer, "PINHOLE", PINHOLE, binary=False)
    image_writer(folder / "images" / "b.png")
    (folder / "images" / "notes.txt").write_text("x")
    recording = read_recording(folder)
    assert [frame.name for frame in recording.frames] == ["a.png"]
    assert [(one.name, one.reason) for one in recording.skipped] == [("b.png", "the model has no pose for it")]


def test_several_models_are_ambiguous(written) -> None:
    folder = written("colmap")
    (folder / "sparse" / "1").mkdir()
    for name in ("cameras.txt", "images.txt"):
        (folder / "sparse" / "1" / name).write_text((folder / "sparse" / "0" / name).read_text())
    with pytest.raises(BadInput, match=r"holds several models, .* give one of .*sparse/0, .*sparse/1"):
        read_recording(folder)
    assert len(read_recording(folder / "sparse" / "0").frames) == 6


@pytest.mark.parametrize("place", ["sparse/0/images", "sparse/images", "images"])
def test_images_beside_and_above_the_model(written, truth, place: str) -> None:
    folder = written("colmap")
    (folder / "images").rename(folder / place)
    for path in (folder, folder / "sparse" / "0"):
        recording = read_recording(path)
        assert [frame.name for frame in recording.frames] == truth.names
        assert recording.frames[0].image.parent == folder / place


def test_images_that_are_nowhere_say_what_to_do(written, tmp_path: Path) -> None:
    folder = written("colmap")
    (folder / "images").rename(tmp_path / "pictures")
    with pytest.raises(BadFile, match=r"none of the model's images is in .*; say where the images are"):
        read_recording(folder)
    with pytest.raises(BadFile, match="nowhere: the folder is missing"):
        read_recording(folder, options=ReadOptions(images=tmp_path / "nowhere"))
    assert len(read_recording(folder, options=ReadOptions(images=tmp_path / "pictures")).frames) == 6


def test_a_name_that_leads_out_is_refused_within(tmp_path: Path, image_writer: Callable) -> None:
    folder = tmp_path / "project"
    folder.mkdir()
    one_image(folder, image_writer, "PINHOLE", PINHOLE, binary=False)
    image_writer(tmp_path / "secret.png")
    (folder / "images.txt").write_text("1 1 0 0 0 0 0 0 1 a.png\n\n2 1 0 0 0 0 0 0 1 ../../secret.png\n\n")
    assert len(read_recording(folder).frames) == 2
    with pytest.raises(RefusedPath, match=r"secret\.png leads outside"):
        read_recording(folder, options=ReadOptions(within=folder))


def test_long_lines_of_points_are_stepped_over(tmp_path: Path, image_writer: Callable) -> None:
    folder = one_image(tmp_path, image_writer, "PINHOLE", PINHOLE, binary=False)
    (folder / "images.txt").write_text("1 1 0 0 0 0 0 0 1 a.png\n" + "1.5 2.5 -1 " * 5000 + "\n")
    assert len(read_recording(folder).frames) == 1
