"""What the surface point that each pixel of a view shows affords: truth of task affordance-view.

A pixel has the labels of the patch of surface (``surfaces``) that its ray meets: seat top yes, chair leg no. What is
level with the floor is walkable where the walk map says so: the floor under a table is not. Pixels that show what is
outside, by a window's glass or through a hole, are void.
"""

from __future__ import annotations

import numba
import numpy as np

from hsbench.geometry.cameras import CentralCamera, TopDownCamera
from hsbench.geometry.transforms import apply
from hsbench.schema.episode import Episode
from hsbench.schema.motions import ObjectMotions
from hsbench.schema.occupancy import VIEW_UNSCORED
from hsbench.schema.scene import Scene
from hsbench.schema.states import Affordance
from hsbench.truth.affordance import AffordanceScene, afford
from hsbench.truth.moving import ignored
from hsbench.truth.sight import ray_image
from hsbench.truth.surfaces import FLAT
from hsbench.typing import BoolArray, FloatArray, Int32Array, IntArray, UInt8Array

ON_FACE_M = 1e-4  # a ray's end lies so close to the face it meets
ON_FLOOR_M = 0.03  # a rug is floor to whoever walks
SCORED = np.uint8(1 << Affordance.WALKABLE | 1 << Affordance.SITTABLE | 1 << Affordance.INTERACTABLE)
GLASS = ("window", "pane")  # category, and how the part's name begins


def view_affordance(
    scene: Scene, camera: CentralCamera, world_T_camera: FloatArray, motions: ObjectMotions, t0_ns: int, end_ns: int
) -> UInt8Array:
    """(h, w) uint8 bits of ``Affordance`` at t0, with ``VIEW_UNSCORED`` where no score counts the pixel.

    Such a pixel is void, or it differs in being walkable, sittable or interactable from t0 for more than half of the
    episode, as things have moved.
    """
    labels, void = labelled_view(afford(scene), camera, world_T_camera)

    def at(moved: Scene) -> UInt8Array:
        return np.asarray(labelled_view(afford(moved), camera, world_T_camera)[0] & SCORED)

    void |= ignored(labels & SCORED, at, scene, motions, t0_ns, end_ns)
    return np.asarray(labels | np.where(void, VIEW_UNSCORED, 0).astype(np.uint8))


def stored_view(episode: Episode) -> UInt8Array | None:
    """What the pixels of an episode afford, as ``view_affordance`` gives it: as stored, or else from the stored scene.

    None where the episode was loaded without truth, or holds neither that nor all of a scene, how its things move and
    where its camera is.
    """
    truth = episode.truth
    if truth is None or truth.view_affordance is not None:
        return None if truth is None else truth.view_affordance
    sensor = truth.sensor or episode.sensor
    camera = sensor.camera
    if truth.scene is None or truth.motions is None or sensor.height_m is None or isinstance(camera, TopDownCamera):
        return None
    return view_affordance(truth.scene, camera, sensor.world_T_camera, truth.motions, episode.t0_ns, episode.end_ns)


def labelled_view(
    found: AffordanceScene, camera: CentralCamera, world_T_camera: FloatArray
) -> tuple[UInt8Array, BoolArray]:
    """((h, w) uint8 bits of ``Affordance``, (h, w) bool void) of a scene in the world frame."""
    image = ray_image(found.scene, camera, world_T_camera)
    hit = image.owner >= 0
    points = apply(world_T_camera, camera.unproject(np.where(hit, image.depth_m, 1.0)))[hit]
    obstacles, patches = found.obstacles, found.patches
    order = np.argsort(obstacles.object_index, kind="stable")
    shapes_of = np.searchsorted(obstacles.object_index[order], np.arange(len(found.scene.objects) + 1))
    patches_of = np.searchsorted(patches.face, np.arange(len(obstacles.shapes.planes) + 1))
    own, shape, up = _labels(
        points, image.owner[hit], world_T_camera[:3, 3].copy(), order, shapes_of, obstacles.shapes.planes,
        obstacles.shapes.start, patches_of, patches.middle, patches.half, found.labels,
    )  # fmt: skip
    index, inside = found.walk.index(points[:, :2])
    walked = (up >= FLAT) & (points[:, 2] <= ON_FLOOR_M) & inside
    walked[walked] = found.walk.free[tuple(index[walked].T)]
    own |= (walked * (1 << Affordance.WALKABLE)).astype(np.uint8)
    glass = np.array(
        [
            found.scene.objects[k].category_name == GLASS[0]
            and found.scene.objects[k].parts[j].name.startswith(GLASS[1])
            for k, j in zip(obstacles.object_index, obstacles.part_index, strict=True)
        ]
    )
    labels, void = np.zeros(hit.shape, dtype=np.uint8), ~hit
    labels[hit], void[hit] = own, (shape >= 0) & glass[shape]
    return labels, void


@numba.njit(cache=True)
def _labels(
    points: FloatArray, owner: Int32Array, eye: FloatArray, shapes: IntArray, shapes_of: IntArray, planes: FloatArray,
    start: IntArray, patches_of: IntArray, middle: FloatArray, half: FloatArray, labels: UInt8Array,
) -> tuple[UInt8Array, Int32Array, FloatArray]:  # fmt: skip
    """(bits, shape, z of the normal) of the face that each of (N, 3) points lies on and that faces the eye; -1: none.

    owner: (N,) index of the object. Its shapes are shapes[shapes_of[k] : shapes_of[k + 1]], and the patches of face f
    those from patches_of[f] to patches_of[f + 1].
    """
    found = np.zeros(len(points), dtype=np.uint8)
    found_shape, up = np.full(len(points), -1, dtype=np.int32), np.zeros(len(points))
    for i in range(len(points)):
        x, y, z = points[i]
        for k in range(shapes_of[owner[i]], shapes_of[owner[i] + 1]):
            s = shapes[k]
            face = -1
            inside = True
            for f in range(start[s, 0], start[s + 1, 0]):
                above = planes[f, 0] * x + planes[f, 1] * y + planes[f, 2] * z - planes[f, 3]
                if above > ON_FACE_M:
                    inside = False
                    break
                before = planes[f, 0] * eye[0] + planes[f, 1] * eye[1] + planes[f, 2] * eye[2] > planes[f, 3]
                if above > -ON_FACE_M and before:
                    face = f
            if not inside or face < 0:
                continue
            found_shape[i], up[i] = s, planes[face, 2]
            for p in range(patches_of[face], patches_of[face + 1]):
                if labels[p] == 0:
                    continue
                u, v, uu, vv = 0.0, 0.0, 0.0, 0.0
                for c in range(3):
                    d = points[i, c] - middle[p, c]
                    u += d * half[face, 0, c]
                    v += d * half[face, 1, c]
                    uu += half[face, 0, c] ** 2
                    vv += half[face, 1, c] ** 2
                if abs(u) <= uu * (1.0 + ON_FACE_M) and abs(v) <= vv * (1.0 + ON_FACE_M):
                    found[i] |= labels[p]
                    break
    return found, found_shape, up
