"""Pictures of images: parts, small ones kept in memory, and made once for all who ask."""

import os
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import cv2
import httpx
import numpy as np
import pytest

from ars_web.api import pictures as module
from ars_web.api.crops import Crop
from ars_web.api.pictures import PictureRequest, Pictures, picture
from ars_web.errors import BadFile
from ars_web.geometry.camera import Camera, rectified

CAMERA = Camera(640, 480, 500.0, 505.0, 310.0, 250.0, "brown", (-0.2, 0.05, 0.0, 0.0, 0.0))


@pytest.fixture(scope="module")
def image(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A smooth picture in which each place has a colour of its own."""
    x, y = np.meshgrid(np.linspace(0, 255, 640), np.linspace(0, 255, 480))
    path = tmp_path_factory.mktemp("pictures") / "image.jpg"
    cv2.imwrite(
        str(path),
        np.stack([x, y, 128 + 100 * np.sin(x / 60)], axis=-1).astype(np.uint8),
        [cv2.IMWRITE_JPEG_QUALITY, 97],
    )
    return path


def decoded(data: bytes) -> np.ndarray:
    return cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR).astype(np.float64)


@pytest.mark.parametrize(
    "crop",
    [Crop(0, 0, 640, 480), Crop(64, 72, 320, 264), Crop(61, 35, 444, 322), Crop(630, 0, 640, 480), Crop(5, 5, 6, 6)],
)
@pytest.mark.parametrize("width", [None, 48, 30, 1000])
@pytest.mark.parametrize("flat", [False, True])
def test_a_part_is_cut_before_it_is_made_smaller(image: Path, crop: Crop, width: int | None, flat: bool):
    data, media_type = picture(PictureRequest(image, CAMERA, width, flat, crop))
    whole = (
        decoded(picture(PictureRequest(image, CAMERA, None, True))[0])
        if flat
        else cv2.imread(str(image)).astype(np.float64)
    )
    want = whole[crop.y0 : crop.y1, crop.x0 : crop.x1]
    if width is not None and width < crop.width:
        want = cv2.resize(want, (width, max(1, round(len(want) * width / crop.width))), interpolation=cv2.INTER_AREA)
    found = decoded(data)
    assert media_type == "image/jpeg"
    assert found.shape == want.shape
    assert np.abs(found - want).mean() < 2.5


@pytest.mark.parametrize("factor", [2, 4, 8])
def test_decoding_a_part_smaller_does_not_shift_it(tmp_path: Path, factor: int):
    """A sharp edge in the middle of the part stays in the middle of the picture."""
    pixels = np.zeros((480, 640, 3), dtype=np.uint8)
    pixels[:, 320:] = 255
    path = tmp_path / "edge.jpg"
    cv2.imwrite(str(path), pixels, [cv2.IMWRITE_JPEG_QUALITY, 97])
    crop = Crop(160, 0, 480, 480)
    width = 320 // factor
    assert module._reduction(width, 640, crop) == factor
    row = decoded(picture(PictureRequest(path, CAMERA, width, False, crop))[0])[5, :, 0]
    assert row.sum() / 255 == pytest.approx(width / 2, abs=0.05 * 8 / factor)


def test_pictures_of_different_parts_have_different_etags(image: Path):
    requests = [
        PictureRequest(image, CAMERA, width, flat, crop)
        for width in (None, 100)
        for flat in (False, True)
        for crop in (None, Crop(0, 0, 8, 8), Crop(0, 0, 8, 9))
    ]
    assert len({request.etag() for request in requests}) == len(requests)


def test_a_part_of_an_image_that_was_exchanged_for_a_smaller_one_is_said_so(tmp_path: Path):
    path = tmp_path / "image.png"
    cv2.imwrite(str(path), np.zeros((100, 100, 3), dtype=np.uint8))
    with pytest.raises(BadFile, match="100 x 100 pixels, but its camera's are 640 x 480"):
        picture(PictureRequest(path, CAMERA, None, False, Crop(200, 200, 300, 300)))


def get(pictures: Pictures, request: PictureRequest) -> bytes:
    return pictures.get(request, request.etag())[0]


def counted(monkeypatch: pytest.MonkeyPatch) -> list[PictureRequest]:
    made: list[PictureRequest] = []

    def count(request: PictureRequest) -> tuple[bytes, str]:
        made.append(request)
        return picture(request)

    monkeypatch.setattr(module, "picture", count)
    return made


def test_a_small_picture_is_made_once(image: Path, monkeypatch: pytest.MonkeyPatch):
    made, pictures = counted(monkeypatch), Pictures()
    request = PictureRequest(image, CAMERA, 160, False)
    assert get(pictures, request) == get(pictures, request) == picture(request)[0]
    assert len(made) == 1
    get(pictures, PictureRequest(image, CAMERA, 160, False, Crop(0, 0, 320, 240)))
    assert len(made) == 2


def test_a_picture_of_an_image_that_changed_is_made_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    made, pictures = counted(monkeypatch), Pictures()
    path = tmp_path / "image.png"
    request = PictureRequest(path, CAMERA, 100, False)
    cv2.imwrite(str(path), np.zeros((480, 640, 3), dtype=np.uint8))
    black = decoded(get(pictures, request))
    cv2.imwrite(str(path), np.full((480, 640, 3), 255, dtype=np.uint8))
    os.utime(path, ns=(1, 1))
    assert decoded(get(pictures, request)).mean() > black.mean() + 200
    assert len(made) == 2


def test_a_large_picture_is_not_kept(image: Path, monkeypatch: pytest.MonkeyPatch):
    made, pictures = counted(monkeypatch), Pictures()
    for width in (None, 401):
        request = PictureRequest(image, CAMERA, width, False)
        assert get(pictures, request) == get(pictures, request)
    assert len(made) == 4


def test_no_more_bytes_are_kept_than_allowed(image: Path, monkeypatch: pytest.MonkeyPatch):
    made = counted(monkeypatch)
    requests = [PictureRequest(image, CAMERA, width, False) for width in range(100, 120)]
    sizes = [len(picture(request)[0]) for request in requests]
    pictures = Pictures(kept_bytes=sum(sizes[-5:]))
    for request in requests:
        get(pictures, request)
    made.clear()
    for request in reversed(requests):
        get(pictures, request)
    assert len(made) >= len(requests) - 6  # those asked for last were still there
    assert len(made) < len(requests)
    alone = Pictures(kept_bytes=10)
    assert get(alone, requests[0]) == get(alone, requests[0])  # too large to be kept, and given all the same


def test_many_who_ask_for_one_picture_wait_for_one_decoding(image: Path, monkeypatch: pytest.MonkeyPatch):
    begun, go_on = threading.Event(), threading.Event()
    made: list[int] = []

    def slow(request: PictureRequest) -> tuple[bytes, str]:
        made.append(1)
        begun.set()
        assert go_on.wait(20)
        return picture(request)

    monkeypatch.setattr(module, "picture", slow)
    pictures, request = Pictures(), PictureRequest(image, CAMERA, 160, False)
    with ThreadPoolExecutor(8) as pool:
        answers = [pool.submit(get, pictures, request) for _ in range(8)]
        assert begun.wait(20)
        go_on.set()
        assert len({answer.result() for answer in answers}) == 1
    assert len(made) == 1


def test_a_picture_that_failed_is_tried_again(tmp_path: Path):
    path, pictures = tmp_path / "image.png", Pictures()
    path.write_bytes(b"no image")
    request = PictureRequest(path, CAMERA, 100, False)
    for _ in range(2):
        with pytest.raises(BadFile):
            pictures.get(request, "same")
    cv2.imwrite(str(path), np.zeros((480, 640, 3), dtype=np.uint8))
    assert pictures.get(request, "same")[1] == "image/jpeg"


# Over HTTP


def test_a_part_of_a_frames_image(client: httpx.Client, sid: str):
    path = f"/api/sessions/{sid}/frames/3/image"
    answer = client.get(f"{path}?crop=40,30,120,90")
    found = decoded(answer.content)
    assert found.shape == (60, 80, 3)
    assert np.abs(found[10, 10] - (0, 0, 255)).max() < 12  # the upper left quarter of the image is red
    assert np.abs(found[50, 70] - 60).max() < 12
    assert decoded(client.get(f"{path}?crop=40,30,120,90&width=40").content).shape == (30, 40, 3)
    assert decoded(client.get(f"{path}?crop=40,30,120,90&rectified=1").content).shape == (60, 80, 3)
    tags = {
        client.get(path + query).headers["etag"]
        for query in ("", "?crop=40,30,120,90", "?crop=40,30,120,91", "?crop=40,30,120,90&width=40")
    }
    assert len(tags) == 4
    known = client.get(f"{path}?crop=40,30,120,90", headers={"If-None-Match": answer.headers["etag"]})
    assert (known.status_code, known.content) == (304, b"")


def test_a_part_of_a_rectified_image_is_cut_out_of_that(server, client: httpx.Client, sid: str):
    flat = rectified(server.services.store.cameras(sid)[0])
    path = f"/api/sessions/{sid}/frames/3/image?rectified=1"
    whole = decoded(client.get(path).content)
    x, y = int(flat.cx), int(flat.cy)
    part = decoded(client.get(f"{path}&crop={x - 20},{y - 20},{x + 20},{y + 20}").content)
    assert np.abs(part - whole[y - 20 : y + 20, x - 20 : x + 20]).mean() < 4


@pytest.mark.parametrize(
    ("crop", "words"),
    [
        ("0,0,161,120", "0,0,161,120 reaches beyond the image, which is 160 x 120 pixels"),
        ("9,9,9,20", "9,9,9,20 is empty"),
        ("all", "'all' must be four whole numbers"),
        ("1,1,5,-5", "four whole numbers"),
        ("", "four whole numbers"),
    ],
)
def test_a_part_that_cannot_be_is_refused(client: httpx.Client, sid: str, crop: str, words: str):
    answer = client.get(f"/api/sessions/{sid}/frames/0/image", params={"crop": crop})
    assert answer.status_code == 422
    assert words in answer.json()["detail"]


def test_browsers_may_keep_pictures_for_a_minute_and_then_ask(client: httpx.Client, sid: str):
    cache = client.get(f"/api/sessions/{sid}/frames/0/image?width=80").headers["cache-control"]
    assert cache == "private, max-age=60, stale-while-revalidate=604800"
