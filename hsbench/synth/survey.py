"""Many generated scenes, checked and counted: what ``hsbench verify --scenes`` and the statistics page print."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from hsbench.schema.scene import Scene
from hsbench.synth.executors import in_order, local
from hsbench.synth.furniture import BUILDERS, COMMON_FAMILIES, NOVEL_FAMILIES
from hsbench.synth.placement import CameraConfig, place_rgbd
from hsbench.synth.rooms import COMMON_TEMPLATES, NOVEL_TEMPLATES, HomeConfig, RoomConfig, build_home, build_scene
from hsbench.synth.rooms.templates import even_weights
from hsbench.synth.seeds import Seeds
from hsbench.truth.sight import ray_image
from hsbench.truth.usability import Uses, uses
from hsbench.truth.validity import Faults, faults
from hsbench.truth.walkable import walk_map

NOVEL_EVERY = 10  # one scene in so many is built from what only test-novel uses
SINGLE_EVERY = 3  # one scene in so many is a single room, the others are homes and offices
SEEN_SHARE = 0.6  # task object-detection-3d: furniture less visible than this is partly or fully occluded


@dataclass(frozen=True)
class Surveyed:
    """One scene: what is wrong with it, and its statistics.

    seconds: to build it.
    room_types, categories: how many of each. furniture: objects of the furniture group in each room.
    sizes_m: (category, length, width, height) of each piece of furniture. free_floor: share where a body can stand.
    occluded: share of the furniture in an RGB-D camera's picture of which less than ``SEEN_SHARE`` is visible.
    """

    number: int
    single: bool
    seconds: float
    faults: Faults
    uses: Uses
    room_types: tuple[str, ...]
    room_m2: tuple[float, ...]
    furniture: tuple[int, ...]
    categories: tuple[tuple[str, int], ...]
    sizes_m: tuple[tuple[str, float, float, float], ...]
    free_floor: float
    occluded: float | None


def survey(numbers: range, seed: int, workers: int = 1) -> Iterator[Surveyed]:
    """Build and examine scenes, in order; a scene depends on its number and the seed alone."""
    return in_order(local(workers), partial(surveyed, seed=seed), numbers)


def drawn_scene(number: int, seed: int) -> Scene:
    """Scene ``number`` of the survey: homes, offices and single rooms, some of them of novel families."""
    seeds = Seeds(seed).child("survey").child(number)
    novel = number % NOVEL_EVERY == 0
    families = NOVEL_FAMILIES if novel else COMMON_FAMILIES
    templates = even_weights(NOVEL_TEMPLATES if novel else COMMON_TEMPLATES)
    room = RoomConfig(templates=templates)
    scene_id = f"survey-{number:06d}"
    if number % SINGLE_EVERY == 0:
        return build_scene(scene_id, seeds, room, families)
    return build_home(scene_id, seeds, HomeConfig(room=room), families)


def surveyed(number: int, seed: int) -> Surveyed:
    """One scene built and examined."""
    start = time.perf_counter()
    scene = drawn_scene(number, seed)
    seconds = time.perf_counter() - start
    boxes = [
        (o.category_name, float(o.box[3]), float(o.box[4]), float(o.box[5]))
        for o in scene.objects
        if o.category.group == "furniture"
    ]
    return Surveyed(
        number,
        number % SINGLE_EVERY == 0,
        seconds,
        faults(scene),
        uses(scene),
        tuple(room.room_type for room in scene.rooms),
        tuple(room.area_m2 for room in scene.rooms),
        _furniture_by_room(scene),
        tuple(sorted(Counter(o.category_name for o in scene.objects).items())),
        tuple(boxes),
        _free_floor(scene),
        _occluded_share(scene, Seeds(seed).child("survey").child(number)),
    )


def _furniture_by_room(scene: Scene) -> tuple[int, ...]:
    middles = np.array([o.box[:2] for o in scene.objects if o.category.group == "furniture"]).reshape(-1, 2)
    owners = [scene.rooms.index(scene.room_at(middle)) for middle in middles]
    return tuple(owners.count(k) for k in range(len(scene.rooms)))


def _free_floor(scene: Scene) -> float:
    walk = walk_map(scene)
    return float(walk.free.sum() * walk.cell_m**2 / sum(room.area_m2 for room in scene.rooms))


def _occluded_share(scene: Scene, seeds: Seeds) -> float | None:
    camera = CameraConfig()
    scene_T_episode, sensor = place_rgbd(scene, camera, seeds.rng("camera"))
    image = ray_image(scene, camera.camera, scene_T_episode @ sensor.world_T_camera)
    visible = np.bincount(image.owner[image.owner >= 0], minlength=len(scene.objects))
    furniture = np.array([o.category.group == "furniture" for o in scene.objects])
    counted = furniture & (image.amodal_px > 0)
    if not counted.any():
        return None
    return float((visible[counted] < SEEN_SHARE * image.amodal_px[counted]).mean())


@dataclass(frozen=True)
class Promise:
    """A line of the table: what is promised, what was found, and whether it is kept."""

    name: str
    measured: str
    kept: bool


LARGEST_HOME = 6  # the times promised are those of homes of up to so many rooms
MEDIAN_S, WORST_S = 0.5, 3.0
USABLE_SHARE = 0.99


def promises(found: list[Surveyed]) -> tuple[Promise, ...]:
    """What the generator promises of its scenes, against what a survey found."""
    deep = sum(len(s.faults.penetrating) for s in found)
    floating = sum(len(s.faults.floating) for s in found)
    doors = sum(len(s.faults.blocked_doors) for s in found)
    seconds = np.array([s.seconds for s in found if not s.single and len(s.room_types) <= LARGEST_HOME])
    types = Counter(kind for s in found for kind in s.room_types)
    built = {name for s in found for name, _ in s.categories}
    missing = sorted(set(BUILDERS) - built)
    lines = [
        Promise("scenes built", f"{len(found)}: {', '.join(f'{n} {k}' for k, n in sorted(types.items()))}", True),
        Promise("pairs of objects penetrating > 1 cm", str(deep), deep == 0),
        Promise("objects floating > 1 cm", str(floating), floating == 0),
        Promise("doors a body of 0.6 m cannot pass", str(doors), doors == 0),
        _share("parts with a functional role usable", [s.uses.functional for s in found]),
        _share("seats usable", [s.uses.seats for s in found]),
        Promise(
            "parts for hands reached upright (task affordance-topdown)",
            _counted([s.uses.upright for s in found])[0],
            True,
        ),
        Promise("categories that never appear", ", ".join(missing) or "none", not missing),
    ]
    if len(seconds):
        median, worst = float(np.median(seconds)), float(seconds.max())
        text = f"median {median:.2f} s, worst {worst:.2f} s ({len(seconds)} homes)"
        lines.append(
            Promise(f"time to build a home of <= {LARGEST_HOME} rooms", text, median <= MEDIAN_S and worst <= WORST_S)
        )
    return tuple(lines)


def _share(name: str, counts: list[tuple[int, int]]) -> Promise:
    text, share = _counted(counts)
    return Promise(name, text, share >= USABLE_SHARE)


def _counted(counts: list[tuple[int, int]]) -> tuple[str, float]:
    good, total = (sum(c[i] for c in counts) for i in range(2))
    share = good / total if total else 1.0
    return f"{100 * share:.2f} % ({good} of {total})", share
