"""What is known of the generated recording: its objects, and where each one is in every image.

All image boxes are image coordinates (x0, y0, x1, y1): (0, 0) is the image's top left corner.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import orjson
from jaxtyping import Float, Int
from pydantic import BaseModel, ConfigDict, ValidationError

from ars_web.errors import BadFile, NotFound
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera

TRUTH_FILE = "truth.json"


@dataclass(frozen=True, eq=False)
class DemoObject:
    """An object of the scene.

    Attributes:
        class_name: one of the recording's classes.
        name: what it is called, unique.
        box: along the object's own axes; its surface touches all six sides.
    """

    class_name: str
    name: str
    box: Box


@dataclass(frozen=True, eq=False)
class DemoTruth:
    """A generated recording of n images with b objects.

    Attributes:
        folder: the ARS scene folder.
        class_names: in order.
        objects: b of them.
        camera: the one camera.
        image_names: n file names below `images/`.
        image_bytes: n sizes of the files.
        Ts_world_camera: (n, 4, 4).
        bbox_amodal: (n, b, 4) round the object's true surface, unclipped, what others hide included; exact to
            0.05 px; NaN where a part of the surface is behind the camera.
        bbox_visible: (n, b, 4) round the pixels that see it; NaN where none does.
        px_in_image: (n, b) pixels whose centre would see it if there were nothing else.
        px_visible: (n, b) pixels whose centre sees it.
    """

    folder: Path
    class_names: tuple[str, ...]
    objects: tuple[DemoObject, ...]
    camera: Camera
    image_names: tuple[str, ...]
    image_bytes: tuple[int, ...]
    Ts_world_camera: Float[np.ndarray, "n 4 4"]
    bbox_amodal: Float[np.ndarray, "n b 4"]
    bbox_visible: Float[np.ndarray, "n b 4"]
    px_in_image: Int[np.ndarray, "n b"]
    px_visible: Int[np.ndarray, "n b"]

    @property
    def visible_fractions(self) -> Float[np.ndarray, "n b"]:
        """(n, b) share of the pixels in the image that nothing hides; 0 where none is in the image."""
        return self.px_visible / np.maximum(self.px_in_image, 1)


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class _ObjectJson(_Strict):
    label: str
    name: str
    T_world_box: list[list[float]]
    size: list[float]


class _SightJson(_Strict):
    object: int
    bbox_amodal: list[float] | None
    bbox_visible: list[float] | None
    px_in_image: int
    px_visible: int
    visible_fraction: float


class _FrameJson(_Strict):
    image: str
    bytes: int
    T_world_camera: list[list[float]]
    objects: list[_SightJson]


class _TruthJson(_Strict):
    version: int
    classes: list[str]
    size: tuple[int, int]
    K: list[list[float]]
    dist: tuple[float, float, float, float]
    objects: list[_ObjectJson]
    frames: list[_FrameJson]


def truth_json(truth: DemoTruth, *, version: int) -> bytes:
    """`truth.json` of a recording."""
    k1, k2, p1, p2, _ = truth.camera.distortion
    fractions = truth.visible_fractions
    content = _TruthJson(
        version=version,
        classes=list(truth.class_names),
        size=(truth.camera.width, truth.camera.height),
        K=truth.camera.K.tolist(),
        dist=(k1, k2, p1, p2),
        objects=[
            _ObjectJson(
                label=thing.class_name,
                name=thing.name,
                T_world_box=thing.box.T_world_box.tolist(),
                size=thing.box.size.tolist(),
            )
            for thing in truth.objects
        ],
        frames=[
            _FrameJson(
                image=name,
                bytes=truth.image_bytes[i],
                T_world_camera=truth.Ts_world_camera[i].tolist(),
                objects=[
                    _SightJson(
                        object=b,
                        bbox_amodal=_or_none(truth.bbox_amodal[i, b]),
                        bbox_visible=_or_none(truth.bbox_visible[i, b]),
                        px_in_image=int(truth.px_in_image[i, b]),
                        px_visible=int(truth.px_visible[i, b]),
                        visible_fraction=float(fractions[i, b]),
                    )
                    for b in range(len(truth.objects))
                ],
            )
            for i, name in enumerate(truth.image_names)
        ],
    )
    return orjson.dumps(content.model_dump(), option=orjson.OPT_APPEND_NEWLINE)


def _or_none(bbox: Float[np.ndarray, "4"]) -> list[float] | None:
    return bbox.tolist() if np.isfinite(bbox).all() else None


def load_demo(folder: Path) -> DemoTruth:
    """The truth of the recording that `make_demo` wrote to `folder`.

    Raises:
        NotFound: there is none.
        BadFile: its truth.json is damaged.
    """
    return load_versioned(folder)[0]


def load_versioned(folder: Path) -> tuple[DemoTruth, int]:
    """The truth and the version of the program that made it; raises as `load_demo`."""
    path = folder / TRUTH_FILE
    try:
        content = path.read_bytes()
    except (FileNotFoundError, NotADirectoryError):
        raise NotFound(f"{folder}: there is no generated recording here (no {TRUTH_FILE})") from None
    try:
        read = _TruthJson.model_validate(orjson.loads(content))
    except (orjson.JSONDecodeError, ValidationError) as error:
        raise BadFile(path, f"not the truth of a generated recording: {error}") from None
    (fx, _, cx), (_, fy, cy) = read.K[0], read.K[1]
    return (
        DemoTruth(
            folder=folder,
            class_names=tuple(read.classes),
            objects=tuple(
                DemoObject(o.label, o.name, Box(np.array(o.T_world_box), np.array(o.size))) for o in read.objects
            ),
            camera=Camera(*read.size, fx, fy, cx, cy, "brown", (*read.dist, 0.0)),
            image_names=tuple(frame.image for frame in read.frames),
            image_bytes=tuple(frame.bytes for frame in read.frames),
            Ts_world_camera=np.array([frame.T_world_camera for frame in read.frames]),
            bbox_amodal=np.array([[_or_nan(o.bbox_amodal) for o in frame.objects] for frame in read.frames]),
            bbox_visible=np.array([[_or_nan(o.bbox_visible) for o in frame.objects] for frame in read.frames]),
            px_in_image=np.array([[o.px_in_image for o in frame.objects] for frame in read.frames]),
            px_visible=np.array([[o.px_visible for o in frame.objects] for frame in read.frames]),
        ),
        read.version,
    )


def _or_nan(bbox: list[float] | None) -> list[float]:
    return [float("nan")] * 4 if bbox is None else bbox
