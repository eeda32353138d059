"""Recordings whose images lie on a store: imported by their headers, exported to the bytes of local ones."""

import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from ars_web.datasets.exports import ExportJobs
from ars_web.datasets.jobs import plan_export, run_export
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.plan import ExportPlan
from ars_web.errors import BadFile, BadInput
from ars_web.recordings import stored_images
from ars_web.recordings.options import ReadOptions
from ars_web.recordings.recording import Recording, StoredImage
from ars_web.recordings.registry import read_recording
from ars_web.recordings.stored_images import local, read_with_stored_images
from ars_web.recordings.stores import StoreFolder, store_folder
from ars_web.sessions.model import SessionSnapshot
from ars_web.sessions.store import SessionStore


@pytest.fixture
def recorded(tmp_path: Path) -> tuple[Path, StoreFolder]:
    """A trajectory and a camera here, four images here and on a store."""
    folder, away = tmp_path / "desk", store_folder(f"memory://{tmp_path.name}/desk/images")
    (folder / "images").mkdir(parents=True)
    random = np.random.default_rng(0)
    for i in range(4):
        path = folder / "images" / f"{i}.jpg"
        # Larger than what is fetched of an image to look at its header.
        assert cv2.imwrite(str(path), random.integers(0, 255, (120, 160, 3), dtype=np.uint8))
        away.write(path.name, path.read_bytes())
    (folder / "poses.txt").write_text("".join(f"{i} {0.01 * i} 0 -1 0 0 0 1\n" for i in range(4)))
    (folder / "camera_intrinsics.txt").write_text("160 120 150 150 79.5 59.5 0 0 0 0\n")
    return folder, away


def read_away(folder: Path, away: StoreFolder) -> Recording:
    # The image folder here is out of the way: nothing of it is used.
    return read_with_stored_images(folder / "poses.txt", away, format="tum", options=ReadOptions())


def files_below(folder: Path) -> dict[str, bytes]:
    files = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


def plan_of(snapshot: SessionSnapshot, out: Path, images: str) -> ExportPlan:
    return plan_export([snapshot], format="coco", options=ExportOptions.model_validate({"images": images}), out=out)


def test_only_headers_and_ends_are_fetched(recorded, monkeypatch: pytest.MonkeyPatch) -> None:
    folder, away = recorded
    monkeypatch.setattr(stored_images, "_HEAD", 1024)
    monkeypatch.setattr(stored_images, "_TAIL", 16)
    monkeypatch.setattr(StoreFolder, "download", lambda self, names, folder: pytest.fail(names[0]) if names else None)
    here, read = read_recording(folder / "poses.txt", format="tum"), read_away(folder, away)
    assert [frame.image for frame in read.frames] == [StoredImage(f"{away}/{i}.jpg") for i in range(4)]
    assert [frame.name for frame in read.frames] == [frame.name for frame in here.frames]
    assert np.array_equal(read.Ts_world_camera, here.Ts_world_camera)


def test_an_image_that_its_ends_do_not_tell_of_is_fetched_whole(recorded, monkeypatch: pytest.MonkeyPatch) -> None:
    folder, away = recorded
    monkeypatch.setattr(stored_images, "_HEAD", 40)
    monkeypatch.setattr(stored_images, "_TAIL", 1)
    away.write("2.jpg", away.read("2.jpg")[:-60])
    read = read_away(folder, away)
    assert [frame.name for frame in read.frames] == ["0.jpg", "1.jpg", "3.jpg"]
    (skipped,) = read.skipped
    assert skipped.reason == f"{away}/2.jpg: the image ends before its data does (truncated)"


@pytest.mark.parametrize("images", ["link", "copy", "rectify"])
def test_an_export_fetches_what_a_local_one_links(recorded, tmp_path: Path, images: str) -> None:
    folder, away = recorded
    with SessionStore(tmp_path / "sessions") as store:
        here = store.create(read_recording(folder / "poses.txt", format="tum"), name="a").id
        there = store.create(read_away(folder, away), name="b").id
        for sid in (here, there):
            run_export(plan_of(replace(store.snapshot(sid), id="s"), tmp_path / sid, images))
    trees = [files_below(tmp_path / sid) for sid in (here, there)]
    documents = [trees[i].pop("dataset.json") for i in range(2)]
    assert documents[0] != documents[1]  # the sessions' names
    assert trees[0] == trees[1]
    assert any(name.endswith("3.jpg") for name in trees[0])


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda away: away.write("2.jpg", away.read("1.jpg")), "the image changed since the export was planned"),
        (lambda away: away.remove(["2.jpg"]), "the image cannot be exported: there is no such file"),
    ],
)
def test_an_image_that_changed_after_planning_fails_the_export(
    recorded, tmp_path: Path, change: Callable[[StoreFolder], None], says: str
) -> None:
    folder, away = recorded
    with SessionStore(tmp_path / "sessions") as store:
        snapshot = store.snapshot(store.create(read_away(folder, away), name="b").id)
    plan = plan_of(snapshot, tmp_path / "d", "link")
    change(away)
    with pytest.raises(BadFile, match=f"2.jpg: {says}"):
        run_export(plan)
    if "no such" in says:
        with pytest.raises(BadFile, match=f"2.jpg: {says}"):
            plan_of(snapshot, tmp_path / "d", "link")


def test_images_can_be_copied_in_from_a_store(recorded, tmp_path: Path) -> None:
    folder, away = recorded
    with SessionStore(tmp_path / "sessions") as store:
        sid = store.create(read_away(folder, away), name="b", copy_images=True).id
        images = store.snapshot(sid).frames.images
    assert [local(image).read_bytes() for image in images] == [away.read(f"{i}.jpg") for i in range(4)]


def test_a_server_fetches_nothing(recorded, tmp_path: Path) -> None:
    folder, away = recorded
    with SessionStore(tmp_path / "sessions") as store:
        sid = store.create(read_away(folder, away), name="b").id
        jobs = ExportJobs(tmp_path / "sessions", store.snapshot)
        try:
            for ask in (jobs.start, jobs.forecast):
                with pytest.raises(BadInput, match="from which a server does not read"):
                    ask(sid, format="yolo", options=ExportOptions())
            job = jobs.start(sid, format="yolo", options=ExportOptions.model_validate({"images": "none"}))
            assert jobs.wait(job.id, timeout=60).state == "done"
        finally:
            jobs.close()
        with pytest.raises(BadFile, match=r"0\.jpg: the image lies on a store"):
            local(store.snapshot(sid).frames.images[0])


def test_what_is_not_there_is_said_with_its_address(recorded, tmp_path: Path) -> None:
    folder, away = recorded
    with pytest.raises(BadFile, match=r"nothing: holds no JPEG and no PNG image"):
        read_away(folder, store_folder(f"{away}/nothing"))
    away.write("4.jpg", away.read("3.jpg"))
    with pytest.raises(BadInput, match=rf"has 4 poses for 5 images in {away}; without"):
        read_away(folder, away)


def test_the_command_line_takes_addresses(recorded, tmp_path: Path) -> None:
    """`file://` is a folder of this machine, and needs no store."""
    folder, _ = recorded

    def run(*arguments: object) -> "subprocess.CompletedProcess[str]":
        line = [sys.executable, "-m", "ars_web", *map(str, arguments), "--sessions", str(tmp_path / "sessions")]
        return subprocess.run(line, capture_output=True, text=True, cwd=Path(__file__).parents[2])

    done = run("import", folder / "poses.txt", "--images", f"file://{folder}/images", "--format", "tum")
    sid = done.stdout.split()[-1]
    assert run("export", sid, "--format", "yolo", "--out", f"file://{tmp_path}/set").returncode == 0
    assert (tmp_path / "set" / "dataset.json").is_file()
    refused = run("import", folder / "poses.txt", "--images", "https://example.org/images", "--format", "tum")
    assert (refused.returncode, refused.stdout) == (1, "")
    assert "no folders that can be listed" in refused.stderr
