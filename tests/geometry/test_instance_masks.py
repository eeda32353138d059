"""Instance masks against rays through the middle of every pixel, and by hand."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from ars_web.errors import BadInput
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.instance_masks import InstanceMasks, Silhouette, instance_masks
from ars_web.geometry.labels import NEAR
from ars_web.geometry.mesh import Mesh
from ars_web.geometry.shape_stack import mesh_of_box

IDENTITY = np.eye(4)
PINHOLE = Camera(64, 48, 50.0, 50.0, 31.5, 23.5)


def upright(x: float, y: float, z: float, size: tuple[float, float, float]) -> Box:
    place = np.array([x, y, z], dtype=np.float64)
    return Box(rigid_transform.from_rotation(np.eye(3), place), np.array(size, dtype=np.float64))


def whole(masks: InstanceMasks, part: Silhouette) -> np.ndarray:
    found = np.zeros(masks.visible.shape, bool)
    rows, columns = part.mask.shape
    found[part.row : part.row + rows, part.column : part.column + columns] = part.mask
    return found


def test_masks_are_what_rays_through_the_pixels_meet(shape_oracle, random_scene, solids):
    """All but the pixels whose middle a border passes by less than rounding can tell."""
    wrong, pixels = 0, 0
    for seed in range(6):
        camera, T, box = random_scene(seed)
        random = np.random.default_rng(seed)
        boxes, meshes = [box], [None]
        for solid in list(solids.values())[seed % 2 :: 2]:
            place = random.normal(size=3) * 0.25 + [0, 0, 0.6]
            turned = T @ rigid_transform.from_position_wxyz(place, random.normal(size=4))
            boxes.append(Box(turned, random.uniform(0.1, 0.6, 3)))
            points = rigid_transform.transform_points(turned, solid.vertices_world * boxes[-1].size)
            meshes.append(Mesh(points, solid.faces))
        masks = instance_masks(camera, T, boxes, meshes)
        rays = shape_oracle.pixel_rays(camera)
        shape = (camera.height, camera.width)
        shapes = [mesh_of_box(b) if mesh is None else mesh for b, mesh in zip(boxes, meshes, strict=True)]
        layers = [shape_oracle.layer(rays, T, mesh, near=NEAR) for mesh in shapes]
        for layer, part in zip(layers, masks.silhouettes, strict=True):
            met = np.isfinite(layer.depth).reshape(shape)
            wrong += int((whole(masks, part) != met).sum())
            pixels += int(met.sum())
            assert part.mask.size == 0 or (
                part.mask[[0, -1]].any(axis=1).all() and part.mask[:, [0, -1]].any(axis=0).all()
            )
        depths = np.array([np.where(layer.inside & np.isfinite(layer.depth), 1e9, layer.depth) for layer in layers])
        nearest = np.where(np.isfinite(depths).any(axis=0), depths.argmin(axis=0), -1).reshape(shape)
        wrong += int((masks.visible != nearest).sum())
        assert masks.visible.dtype == np.int16
    assert pixels > 50_000
    assert wrong < 20


def test_half_of_a_square_is_behind_another():
    far, near = upright(0, 0, 1.0, (0.4, 0.4, 1e-6)), upright(0.1, 0, 0.5, (0.2, 0.2, 1e-6))
    masks = instance_masks(PINHOLE, IDENTITY, [far, near], [mesh_of_box(far), None])
    square = np.zeros((48, 64), bool)
    square[14:34, 22:42] = True
    assert_array_equal(whole(masks, masks.silhouettes[0]), square)
    right = np.zeros((48, 64), bool)
    right[14:34, 32:52] = True
    assert_array_equal(whole(masks, masks.silhouettes[1]), right)
    assert_array_equal(whole(masks, masks.visible_of(0)), square & ~right)
    assert_array_equal(masks.visible == 1, right)
    assert (masks.silhouettes[0].row, masks.silhouettes[0].column) == (14, 22)


def test_a_flat_mesh_is_seen_from_either_side():
    corners = np.array([[-0.2, -0.2, 1.0], [0.2, -0.2, 1.0], [0.2, 0.2, 1.0], [-0.2, 0.2, 1.0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    bound = upright(0, 0, 1.0, (0.4, 0.4, 1e-6))
    for order in (slice(None), slice(None, None, -1)):
        mesh = Mesh(corners[order], np.concatenate([faces, faces[:, ::-1]]))
        masks = instance_masks(PINHOLE, IDENTITY, [bound], [mesh])
        assert masks.silhouettes[0].mask.all()
        assert masks.silhouettes[0].mask.shape == (20, 20)


def test_what_is_not_in_the_image_has_no_pixels():
    behind, beside = upright(0, 0, -1.0, (0.5, 0.5, 0.5)), upright(5, 0, 1.0, (0.5, 0.5, 0.5))
    masks = instance_masks(PINHOLE, IDENTITY, [behind, beside], [None, None])
    assert [part.mask.shape for part in masks.silhouettes] == [(0, 0), (0, 0)]
    assert (masks.visible == -1).all()


def test_a_shape_round_the_camera_is_seen_where_no_other_is():
    room, thing, outside = upright(0, 0, 0, (8, 8, 8)), upright(0, 0, 2.0, (0.4, 0.4, 0.4)), upright(3, 0, 9, (1, 1, 1))
    for order in ([0, 1, 2], [2, 1, 0]):
        boxes = [(room, thing, outside)[i] for i in order]
        masks = instance_masks(PINHOLE, IDENTITY, boxes, [None] * 3)
        assert masks.silhouettes[order.index(0)].mask.all()
        for i in (1, 2):
            number = order.index(i)
            assert_array_equal(whole(masks, masks.silhouettes[number]), masks.visible == number)
        assert (masks.visible == order.index(0)).sum() > 2000


def test_no_shapes_and_too_few_meshes():
    masks = instance_masks(PINHOLE, IDENTITY, [], [])
    assert (masks.visible == -1).all()
    assert masks.silhouettes == ()
    with pytest.raises(BadInput, match="1 boxes and 0 meshes"):
        instance_masks(PINHOLE, IDENTITY, [upright(0, 0, 1, (1, 1, 1))], [])
