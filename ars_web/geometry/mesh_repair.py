"""Surfaces from files as meshes that labels can read: corners shared, faces turned outward, and closed."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int


class Repaired(NamedTuple):
    """A surface that is closed in the sense of `mesh.Mesh`, and what was done to it.

    Attributes:
        vertices: (v, 3), each used.
        faces: (f, 3) rows of `vertices`; none where all were dropped.
        dropped: faces with a corner twice, and faces that were there before.
        turned: faces that were turned round.
        open_edges: those at which the surface ended, so that every face was given a back.
    """

    vertices: Float[np.ndarray, "v 3"]
    faces: Int[np.ndarray, "f 3"]
    dropped: int
    turned: int
    open_edges: int


def repaired(vertices: Float[np.ndarray, "v 3"], faces: Int[np.ndarray, "f 3"]) -> Repaired:
    """The surface with equal corners merged, faces that say nothing dropped, and all turned one way, outward where it
    encloses something. One that is closed and turned one way already stays as it is, hollows included.

    A surface that ends somewhere, or has but one side, gets a back to every face: it is seen from both sides.
    """
    vertices, faces, dropped = _tidied(vertices, faces)
    if len(faces) == 0:
        return Repaired(vertices, faces, dropped, 0, 0)
    turned = 0
    if _unbalanced(faces).any():
        component, flips = _turned_one_way(faces)
        wound = np.where(flips[:, None], faces[:, ::-1], faces)
        is_open = np.zeros(component.max() + 1, dtype=bool)
        is_open[component[_unbalanced(wound).any(axis=1)]] = True
        inward = (np.bincount(component, _volumes(vertices, wound)) < 0.0) & ~is_open
        flips = flips ^ inward[component]
        faces, turned = np.where(flips[:, None], faces[:, ::-1], faces), int(flips.sum())
    elif _volumes(vertices, faces).sum() < 0.0:
        faces, turned = faces[:, ::-1].copy(), len(faces)
    open_edges = _unbalanced(faces)
    if not open_edges.any():
        return Repaired(vertices, faces, dropped, turned, 0)
    starts, ends = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    key = np.minimum(starts, ends) * len(vertices) + np.maximum(starts, ends)
    count = len(np.unique(key[open_edges.ravel()]))
    # As `two_sided` has them; where a face and its back were both there, neither comes twice.
    sides = np.concatenate([faces, faces[:, [0, 2, 1]]])
    return Repaired(vertices, sides[np.sort(_first_of_each(sides))], dropped, 0, count)


def _tidied(
    vertices: Float[np.ndarray, "v 3"], faces: Int[np.ndarray, "f 3"]
) -> tuple[Float[np.ndarray, "w 3"], Int[np.ndarray, "g 3"], int]:
    """Corners and faces without repeats, in their old order, and how many faces went."""
    used, which = np.unique(faces, return_inverse=True)
    points = vertices[used] + 0.0
    _, first, same = np.unique(points, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    merged = rank[same.ravel()][which.ravel()].reshape(-1, 3)
    a, b, c = merged.T
    kept = np.flatnonzero((a != b) & (b != c) & (c != a))
    kept = kept[np.sort(_first_of_each(merged[kept]))]
    still, rows = np.unique(merged[kept], return_inverse=True)
    return points[np.sort(first)][still], rows.reshape(-1, 3), len(faces) - len(kept)


def _first_of_each(faces: Int[np.ndarray, "f 3"]) -> Int[np.ndarray, "g"]:
    """The first of the faces that have the same corners in the same order round."""
    if len(faces) == 0:
        return np.empty(0, dtype=np.int64)
    lowest = np.argmin(faces, axis=1)[:, None]
    turned = np.take_along_axis(faces, (lowest + np.arange(3)) % 3, axis=1)
    return np.unique(turned, axis=0, return_index=True)[1]


def _unbalanced(faces: Int[np.ndarray, "f 3"]) -> Bool[np.ndarray, "f 3"]:
    """Of each face's edges, from its first corner on, whether they are not run along as often one way as the other."""
    starts, ends = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    key = np.minimum(starts, ends) * (int(faces.max()) + 1) + np.maximum(starts, ends)
    _, which = np.unique(key, return_inverse=True)
    balance = np.bincount(which, np.where(starts < ends, 1, -1))
    return (balance[which] != 0).reshape(-1, 3)


def _turned_one_way(faces: Int[np.ndarray, "f 3"]) -> tuple[Int[np.ndarray, "f"], Bool[np.ndarray, "f"]]:
    """The piece that each face is of, and which faces are to be turned so that those of a piece agree.

    Faces go together across edges that exactly two of them have. The first face of a piece stays.
    """
    # SciPy takes half a second to load, which commands that read no mesh need not wait for.
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import breadth_first_order, connected_components

    count = len(faces)
    starts, ends = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    owners = np.repeat(np.arange(count), 3)
    key = np.minimum(starts, ends) * (int(faces.max()) + 1) + np.maximum(starts, ends)
    order = np.argsort(key, kind="stable")
    _, first, size = np.unique(key[order], return_index=True, return_counts=True)
    one, other = order[first[size == 2]], order[first[size == 2] + 1]
    # 1: they run along their edge in opposite directions, as neighbours should; 2: in the same one.
    weights = np.where((starts < ends)[one] == (starts < ends)[other], 2, 1)
    pairs, which = np.unique(owners[one] * count + owners[other], return_index=True)
    rows, columns = pairs // count, pairs % count
    shape = (count + 1, count + 1)
    graph = csr_array((weights[which], (rows, columns)), shape=shape)
    component = connected_components(graph, directed=False)[1][:count]
    _, heads = np.unique(component, return_index=True)
    # One more node, from which every piece is reached.
    joined = csr_array(
        (
            np.concatenate([weights[which], weights[which], np.ones(len(heads), dtype=np.int64)]),
            (
                np.concatenate([rows, columns, np.full(len(heads), count)]),
                np.concatenate([columns, rows, heads]),
            ),
        ),
        shape=shape,
    )
    reached, before = breadth_first_order(joined, count)
    steps = reached[1:]
    same_way = np.asarray(joined[before[steps], steps]).ravel() == 2
    flips = [False] * (count + 1)
    for face, parent, is_same in zip(steps.tolist(), before[steps].tolist(), same_way.tolist(), strict=True):
        flips[face] = flips[parent] != is_same
    return component, np.array(flips[:count])


def _volumes(vertices: Float[np.ndarray, "v 3"], faces: Int[np.ndarray, "f 3"]) -> Float[np.ndarray, "f"]:
    """Of the tetrahedra between the faces and the middle of all corners; their sum is what a closed mesh encloses."""
    a, b, c = (vertices[faces[:, i]] - vertices.mean(axis=0) for i in range(3))
    return (np.cross(a, b) * c).sum(axis=1) / 6.0
