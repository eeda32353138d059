"""What lies on the desk, and where the camera goes: metres, z up, the desk's top at z = 0."""

import math
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float

from ars_web.demo import shapes
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.rigid_transform import Transform

DESK_HALF_SIZE = (0.86, 0.66, 0.016)

CLASS_NAMES = ("box", "ball", "can", "mug", "tape")

T_WRIST_CAMERA: Transform = rigid_transform.from_position_wxyz(
    np.array([0.041, -0.023, 0.087]), np.array([0.70, 0.02, -0.05, 0.71])
)
"""Where a robot's hand would hold the camera; any rotation and offset would do, none is too little of a test."""


@dataclass(frozen=True)
class Finish:
    """How a surface shines.

    Attributes:
        mirror: share of light reflected straight on; more at grazing angles (Schlick).
        gloss: strength of the broad highlight of the window.
        sharpness: its exponent (Blinn-Phong).
        metal: whether what is reflected takes the picture's colour.
    """

    mirror: float
    gloss: float
    sharpness: float
    metal: bool = False


CARD = Finish(mirror=0.0, gloss=0.06, sharpness=18)
LACQUER = Finish(mirror=0.04, gloss=0.25, sharpness=120)
GLAZE = Finish(mirror=0.05, gloss=0.35, sharpness=260)
FELT = Finish(mirror=0.0, gloss=0.0, sharpness=4)
TIN = Finish(mirror=0.55, gloss=0.5, sharpness=60, metal=True)
PRINTED_TIN = Finish(mirror=0.10, gloss=0.4, sharpness=60)
WOOD = Finish(mirror=0.0, gloss=0.10, sharpness=26)


@dataclass(frozen=True, eq=False)
class Part:
    """One shape of an object.

    Attributes:
        kind: shapes.BOX, BALL, CYLINDER, TUBE or HANDLE.
        size: the shape's up to four lengths.
        middle: of the shape in the object's building frame (axes along the object's own).
        looks: one (picture, finish) a surface.
        rolled: (3, 3) how the shape is turned in the building frame. It turns the picture only: a ball any way, a
            cylinder about its axis.
    """

    kind: int
    size: tuple[float, ...]
    middle: tuple[float, float, float]
    looks: tuple[tuple[str, Finish], ...]
    rolled: Float[np.ndarray, "3 3"] = field(default_factory=lambda: np.eye(3))

    @property
    def extent(self) -> Float[np.ndarray, "2 3"]:
        """The least and the greatest coordinates of its surface, in the object's building frame."""
        a = self.size
        if self.kind == shapes.HANDLE:
            reach = a[0] + a[1]
            low, high = [max(-reach, a[2]), -a[1], -reach], [reach, a[1], reach]
        else:
            half = {
                shapes.BOX: lambda: [a[0], a[1], a[2]],
                shapes.BALL: lambda: [a[0], a[0], a[0]],
                shapes.CYLINDER: lambda: [a[0], a[0], a[1]],
                shapes.TUBE: lambda: [a[0], a[0], a[2]],
            }[self.kind]()
            low, high = [-h for h in half], half
        return np.array([low, high]) + self.middle


@dataclass(frozen=True, eq=False)
class Thing:
    """An object on the desk.

    Attributes:
        class_name, name: what it is labelled, and what it is called.
        parts: its shapes.
        T_world_build: (4, 4) from the frame that its parts are given in.
    """

    class_name: str
    name: str
    parts: tuple[Part, ...]
    T_world_build: Transform

    @property
    def box(self) -> Box:
        """The box along the object's own axes that touches its surface on all six sides."""
        extents = np.array([part.extent for part in self.parts])
        low, high = extents[:, 0].min(axis=0), extents[:, 1].max(axis=0)
        middle = rigid_transform.from_rotation(np.eye(3), (low + high) / 2)
        return Box(self.T_world_build @ middle, high - low)


def _standing(x: float, y: float, *, turn: float, z: float = 0.0) -> Transform:
    return rigid_transform.from_rotation(rigid_transform.rotation_about_z(math.radians(turn)), np.array([x, y, z]))


def _lying(x: float, y: float, *, turn: float, radius: float) -> Transform:
    """A round thing on its side: its axis is horizontal, along `turn`."""
    tipped = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    yaw = rigid_transform.rotation_about_z(math.radians(turn))
    return rigid_transform.from_rotation(yaw @ tipped, np.array([x, y, radius]))


def _carton(half: tuple[float, float, float], faces: tuple[str, ...], finish: Finish) -> tuple[Part, ...]:
    return (Part(shapes.BOX, half, (0.0, 0.0, half[2]), tuple((face, finish) for face in faces)),)


def _mug(radius: float, height: float) -> tuple[Part, ...]:
    wall, floor = 0.0035, 0.006
    outside, inside = ("mug outside", GLAZE), ("mug inside", GLAZE)
    ring = 0.027
    return (
        Part(
            shapes.TUBE,
            (radius, radius - wall, height / 2),
            (0.0, 0.0, height / 2),
            (outside, inside, inside, inside),
        ),
        Part(shapes.CYLINDER, (radius - wall / 2, floor / 2), (0.0, 0.0, floor / 2), (inside, inside, inside)),
        # Coffee up to two thirds.
        Part(
            shapes.CYLINDER,
            (radius - wall, 0.001),
            (0.0, 0.0, 0.68 * height),
            (("coffee", GLAZE),) * 3,
        ),
        # Cut off within the wall: what the ring would have inside the mug is gone.
        Part(
            shapes.HANDLE,
            (ring, 0.0055, -0.006 - wall / 2),
            (radius + 0.006, 0.0, height / 2),
            (("mug handle", GLAZE),),
        ),
    )


def _can(radius: float, height: float, wrap: str, end: str) -> tuple[Part, ...]:
    looks = ((wrap, PRINTED_TIN), (end, TIN), (end, TIN))
    return (Part(shapes.CYLINDER, (radius, height / 2), (0.0, 0.0, height / 2), looks),)


def _can_that_rolled(radius: float, height: float, wrap: str, end: str, *, roll: float) -> tuple[Part, ...]:
    """A can about its middle, its label turned by `roll` degrees."""
    (standing,) = _can(radius, height, wrap, end)
    rolled = rigid_transform.rotation_about_z(math.radians(roll))
    return (replace(standing, middle=(0.0, 0.0, 0.0), rolled=rolled),)


def _ball(radius: float, picture: str, finish: Finish, *, came_to_rest: tuple[float, ...]) -> tuple[Part, ...]:
    """A ball, its poles wherever they were when it stopped: a quaternion w x y z."""
    rolled = rigid_transform.rotation_from_wxyz(np.array(came_to_rest))
    return (Part(shapes.BALL, (radius,), (0.0, 0.0, radius), ((picture, finish),), rolled),)


def things() -> tuple[Thing, ...]:
    """The labelled objects. None reaches into another (a test sees to that)."""
    tea = ("tea side", "tea side", "tea front", "tea front", "tea end", "tea end")
    chocolate = ("chocolate end", "chocolate end", "chocolate side", "chocolate side", "chocolate top", "chocolate top")
    die = ("die 2", "die 5", "die 3", "die 4", "die 6", "die 1")
    tape = (("tape outside", LACQUER), ("tape inside", CARD), ("tape ring", CARD), ("tape ring", CARD))
    return (
        Thing("box", "tea", _carton((0.062, 0.031, 0.081), tea, CARD), _standing(-0.06, 0.145, turn=-22)),
        Thing("box", "chocolate", _carton((0.10, 0.05, 0.0145), chocolate, CARD), _standing(0.165, -0.015, turn=-32)),
        Thing("box", "die", _carton((0.021, 0.021, 0.021), die, LACQUER), _standing(0.195, -0.045, turn=23, z=0.029)),
        Thing(
            "ball",
            "tennis ball",
            _ball(0.0335, "tennis", FELT, came_to_rest=(0.6, 0.5, -0.3, 0.4)),
            _standing(0.055, -0.165, turn=20),
        ),
        Thing(
            "ball",
            "beach ball",
            _ball(0.058, "beach", LACQUER, came_to_rest=(0.5, 0.62, 0.55, -0.2)),
            _standing(0.17, 0.165, turn=-30),
        ),
        Thing("can", "cola", _can(0.033, 0.115, "cola", "can end"), _standing(0.03, 0.02, turn=-75)),
        Thing(
            "can",
            "tomatoes",
            _can_that_rolled(0.0375, 0.105, "tomato", "tin end", roll=200),
            _lying(-0.105, -0.15, turn=38, radius=0.0375),
        ),
        Thing("mug", "mug", _mug(0.041, 0.095), _standing(-0.185, -0.015, turn=215)),
        Thing(
            "tape",
            "parcel tape",
            (Part(shapes.TUBE, (0.051, 0.038, 0.024), (0.0, 0.0, 0.024), tape),),
            _standing(-0.235, 0.145, turn=10),
        ),
    )


def desk() -> Thing:
    """What the things stand on; it has no class and no label."""
    side = ("desk side", WOOD)
    part = Part(shapes.BOX, DESK_HALF_SIZE, (0.0, 0.0, -DESK_HALF_SIZE[2]), (side,) * 5 + (("desk", WOOD),))
    return Thing("", "desk", (part,), np.eye(4))


def camera(width: int, height: int) -> Camera:
    """A lens with clear barrel distortion and its centre off the image's, at any image size of about 4 : 3."""
    f = width / 960
    cx, cy = width / 2 - 0.5 + 17.3 * f, height / 2 - 0.5 - 12.8 * f
    return Camera(width, height, 812.4 * f, 809.7 * f, cx, cy, "brown", (-0.192, 0.061, 0.0012, -0.0009, 0.0))


def camera_path(frames: int) -> Float[np.ndarray, "n 4 4"]:
    """`Ts_world_camera` of a hand-held walk once round the desk, the same walk however many frames it is cut into.

    The height rises and falls, about half way the camera goes close, and at the end it turns to an empty corner
    of the desk: the last frame, and with 60 the last three, have no object in view.
    """
    return np.array([_camera_at(i / max(frames - 1, 1)) for i in range(frames)])


def _camera_at(s: float) -> Transform:
    """The camera's pose at the share `s` of its way."""
    azimuth = math.radians(-38 + 372 * s)
    close = math.exp(-(((s - 0.56) / 0.055) ** 2))
    elevation = math.radians(38 + 13 * math.sin(4 * math.pi * s + 1.1) - 9 * close)
    distance = 0.66 + 0.12 * math.sin(6 * math.pi * s + 0.4) - 0.36 * close
    outward = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
    target = np.array([0.07 * math.sin(9 * s), 0.06 * math.cos(7 * s), 0.045]) + 0.10 * close * outward
    eye = target + distance * (math.cos(elevation) * outward + np.array([0.0, 0.0, math.sin(elevation)]))
    leave = float(np.clip((s - 0.915) / 0.055, 0, 1))
    leave = leave * leave * (3 - 2 * leave)
    eye = eye + leave * (np.array([0.74, -0.56, 0.40]) - eye)
    target = target + leave * (np.array([0.665, -0.46, 0.0]) - target)
    sway = np.array([math.sin(41 * s), math.sin(53 * s + 1), math.sin(47 * s + 2)])
    roll = math.radians(2.2 * math.sin(23 * s + 0.5))
    return _looking(eye + 0.004 * sway, target - 0.005 * sway, roll=roll)


def _looking(eye: Float[np.ndarray, "3"], target: Float[np.ndarray, "3"], *, roll: float) -> Transform:
    """A camera at `eye` that has `target` on its axis, upright but for `roll`."""
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    upright = np.column_stack([right, np.cross(forward, right), forward])
    return rigid_transform.from_rotation(upright @ rigid_transform.rotation_about_z(roll), eye)
