"""Contact sheets of simulated people, to look at: walking, sitting, using things, lying, gestures, meetings.

    python people_pictures.py OUT [SHEET ...]           OUT/people-SHEET.jpg

Lives of the natural mode in furnished rooms; of their event logs as many moments of each activity are taken as a sheet
wants, at most one of a kind from a life. A camera stands 2-3.5 m away, on the side that the person faces, where most of
the body can be seen. Captions say what the event log says.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from hsbench.geometry.cameras import PinholeCamera
from hsbench.geometry.rays import PackedSolids, pack_solids, segments_blocked
from hsbench.geometry.transforms import invert, planar
from hsbench.schema import KINECT_V2
from hsbench.schema.scene import Scene
from hsbench.schema.sensor import Sensor
from hsbench.synth.activities import Life, LifeConfig, live
from hsbench.synth.assemble import poses_in, scene_in
from hsbench.synth.film import Filming, room_lighting
from hsbench.synth.furniture import COMMON_FAMILIES
from hsbench.synth.render import Renderer, open_renderer
from hsbench.synth.rooms import RoomConfig, build_scene
from hsbench.synth.seeds import Seeds

FPS = 30
CELL_PX = (300, 300)
COLUMNS, BAND_PX, QUALITY = 4, 26, 82
CAMERA = PinholeCamera(*CELL_PX, 300.0, 300.0, CELL_PX[0] / 2, CELL_PX[1] / 2)
DISTANCES_M, HEIGHTS_M = (2.2, 2.7, 3.2), (1.4, 1.9)
BEARINGS_RAD = np.radians([35, -35, 60, -60, 90, -90, 10, 130, -130])  # from where the person faces, best first
SEEN_SHARE = 0.6  # of the joints
FROM_WALL_M = 0.15
WALKS_M_S = 0.5
MOST_LIVES = 60
J = KINECT_V2.names.index


@dataclass(frozen=True)
class Sheet:
    """What a sheet shows: (activity, category it is done with or "", how many), in which rooms, when, by how many."""

    wanted: tuple[tuple[str, str, int], ...]
    templates: tuple[str, ...]
    hours: tuple[float, ...]
    people: int = 2
    duration_s: float = 600.0


HOME = ("living_dining", "living_kitchen", "bedroom_sitting", "kitchen_table", "living_wall", "study_free")
KITCHENS = ("living_kitchen", "kitchen_table", "kitchen_run", "dining_kitchen", "kitchen_island", "kitchen_corner")
SHEETS = {
    "walk": Sheet((("walk", "", 8), ("stand", "", 2), ("look", "window", 2)), HOME, (10.0, 15.0)),
    "sit": Sheet(
        (("rest", "sofa", 1), ("rest", "armchair", 1), ("rest", "chair", 1), ("watch_tv", "", 3),
         ("eat", "", 2), ("drink", "", 1), ("read", "sofa", 1), ("read", "bed", 1), ("rest", "bed", 1)),
        HOME, (12.5, 21.0),
    ),
    "use": Sheet(
        (("use_fridge", "", 2), ("use_storage", "", 3), ("use_wardrobe", "", 1), ("wash_hands", "", 1), ("cook", "", 2),
         ("use_appliance", "", 1), ("draw_back", "", 1), ("wipe", "", 1)),
        (*KITCHENS, "bathroom_tub", "bedroom_plain", "living_wall", "bathroom_laundry"), (8.0, 12.0),
    ),
    "lie": Sheet((("sleep", "", 4), ("nap", "", 4)), ("bedroom_plain", "living_bedsit", "bedroom_sitting",
                 "living_wall", "living_free"), (2.0, 14.5), 1, 900.0),
    "gestures": Sheet(
        (("eat", "", 1), ("drink", "", 1), ("phone", "", 2), ("read", "", 1), ("work_at_desk", "", 2), ("talk", "", 2),
         ("wash_up", "", 1), ("write", "", 1), ("write_on_board", "", 1)),
        ("study_free", "living_dining", "dining_kitchen", "meeting_board", "study_wall", "kitchen_table"), (10.0, 13.0),
    ),
    "meet": Sheet(
        (("meeting", "", 5), ("eat", "", 3), ("talk", "", 2), ("watch_tv", "", 2)),
        ("meeting_board", "dining_middle", "meeting_screen", "living_dining", "meeting_both"), (10.5, 12.5, 20.0), 4,
    ),
}  # fmt: skip


@dataclass(frozen=True)
class Moment:
    """A frame of an event: what is done, with what, by whom, when."""

    kind: tuple[str, str, int]
    caption: str
    person: int
    timestamp_ns: int


def main(out: Path, names: tuple[str, ...]) -> None:
    """Write the sheets."""
    out.mkdir(parents=True, exist_ok=True)
    renderer = open_renderer()
    for name in names or tuple(SHEETS):
        cells = list(cells_of(SHEETS[name], renderer))
        path = out / f"people-{name}.jpg"
        cv2.imwrite(str(path), laid_out(cells)[:, :, ::-1], [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
        print(f"{path}: {len(cells)} cells, {path.stat().st_size // 1000} kB", flush=True)


def cells_of(sheet: Sheet, renderer: Renderer) -> Iterator[np.ndarray]:
    """Captioned pictures of a sheet, from as many lives as it takes."""
    missing = {kind: kind[2] for kind in sheet.wanted}
    for number in range(MOST_LIVES):
        if not any(missing.values()):
            return
        template = sheet.templates[number % len(sheet.templates)]
        hour = sheet.hours[number // len(sheet.templates) % len(sheet.hours)]
        seeds = Seeds(4).child(number)
        room = RoomConfig(templates=((template, 1.0),))
        scene = build_scene("x", seeds.child("room"), room, COMMON_FAMILIES)
        config = LifeConfig(
            duration_s=sheet.duration_s, people=sheet.people, mode="natural", start_hour=hour, arrival_s=(2.0, 8.0)
        )
        life = live(scene, seeds.child("life"), config)
        packed = pack_solids([solid for item in scene.objects for solid in item.solids])
        for moment in moments(scene, life, [kind for kind, n in missing.items() if n], seeds.rng("moments")):
            if not missing[moment.kind]:
                continue
            placed = placement(scene, life, packed, moment)
            if placed is not None:
                missing[moment.kind] -= 1
                picture = photograph(scene, life, *placed, moment.timestamp_ns, renderer)
                yield captioned(picture, f"{moment.caption}, {template}")
                print(f"life {number} at {moment.timestamp_ns / 1e9:.1f} s: {moment.caption}, {template}", flush=True)
    print("not found:", {kind: n for kind, n in missing.items() if n})


def moments(scene: Scene, life: Life, kinds: list[tuple[str, str, int]], rng: np.random.Generator) -> Iterator[Moment]:
    """A few moments of each kind, in random order within a kind."""
    events = life.events
    for kind in kinds:
        if kind[0] == "walk":
            yield from walks(life, kind, rng)
            continue
        rows = [row for row in range(len(events)) if events.activity[row] == kind[0]]
        for row in rng.permutation(rows).tolist()[:3]:
            number = int(events.object_id[row])
            category = scene.object(number).category_name if number else ""
            if kind[1] and category != kind[1]:
                continue
            share = rng.uniform(0.4, 0.8)
            stamp = life.poses.timestamp_ns
            when = events.start_ns[row] + share * (events.end_ns[row] - events.start_ns[row])
            person = int(events.person_id[row])
            mine = stamp[life.poses.track_id == person]
            caption = " ".join(word for word in (kind[0], category, events.part[row]) if word)
            yield Moment(kind, caption, person, int(mine[np.argmin(np.abs(mine - when))]))
            break


def walks(life: Life, kind: tuple[str, str, int], rng: np.random.Generator) -> Iterator[Moment]:
    """Frames of somebody on the way."""
    assert life.poses.joints_m is not None
    for person in range(1, len(life.bodies) + 1):
        mine = life.poses.track_id == person
        speed = np.linalg.norm(np.gradient(life.poses.joints_m[mine, 0, :2], axis=0), axis=1) * FPS
        fast = np.flatnonzero(speed > WALKS_M_S)
        if len(fast):
            yield Moment(kind, "walk", person, int(life.poses.timestamp_ns[mine][rng.choice(fast)]))


def placement(scene: Scene, life: Life, packed: PackedSolids, moment: Moment) -> tuple[np.ndarray, Sensor] | None:
    """(scene_T_episode, sensor) of a camera that sees the person of a moment; None where there is no place."""
    assert life.poses.joints_m is not None
    now = life.poses.timestamp_ns == moment.timestamp_ns
    mine = life.poses.joints_m[now & (life.poses.track_id == moment.person)][0].astype(np.float64)
    everybody = life.poses.joints_m[now, 0].astype(np.float64)
    middle = (mine.min(axis=0) + mine.max(axis=0)) / 2
    across = mine[J("hip_left"), :2] - mine[J("hip_right"), :2]
    facing = math.atan2(-across[0], across[1])
    room = scene.room_at(middle[:2])
    best, most = None, SEEN_SHARE
    for rank, bearing in enumerate(BEARINGS_RAD):
        for distance_m in DISTANCES_M:
            for height_m in HEIGHTS_M:
                angle = facing + bearing
                xy = middle[:2] + distance_m * np.array([math.cos(angle), math.sin(angle)])
                around = xy + FROM_WALL_M * np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])
                if not scene.contains(around).all() or scene.room_at(xy) is not room:
                    continue
                if np.linalg.norm(everybody[:, :2] - xy, axis=1).min() < 1.0:
                    continue
                eye = np.array([*xy, height_m])
                seen = 1 - segments_blocked(eye, mine, packed).mean() - 0.02 * rank
                if seen > most:
                    best, most = (eye, angle + math.pi), seen
    if best is None:
        return None
    eye, heading = best
    tilt = math.atan2(eye[2] - middle[2], float(np.linalg.norm(eye[:2] - middle[:2])))
    return planar(eye[0], eye[1], heading), Sensor("rgbd", CAMERA, float(eye[2]), tilt)


def photograph(
    scene: Scene, life: Life, scene_T_episode: np.ndarray, sensor: Sensor, timestamp_ns: int, renderer: Renderer
) -> np.ndarray:
    """(h, w, 3) sRGB."""
    episode_T_scene = invert(scene_T_episode)
    here = scene_in(episode_T_scene, scene)
    lights = room_lighting(here, sensor.world_T_camera[:2, 3])
    poses = poses_in(episode_T_scene, life.poses)
    filming = Filming(here, life.bodies, poses, sensor, renderer, lights, life.motions, life.held)
    background = filming.background()
    patch = filming.patch(background, timestamp_ns)
    rgb = background.rgb.copy()
    window = rgb[patch.row : patch.row + patch.mask.shape[0], patch.column : patch.column + patch.mask.shape[1]]
    window[patch.mask] = patch.picture.rgb[patch.mask]
    return rgb


def captioned(picture: np.ndarray, text: str) -> np.ndarray:
    """The picture over a white band with the text."""
    band = np.full((BAND_PX, picture.shape[1], 3), 255, np.uint8)
    cv2.putText(band, text, (4, BAND_PX - 8), cv2.FONT_HERSHEY_SIMPLEX, 0.42, (0, 0, 0), 1, cv2.LINE_AA)
    return np.concatenate([picture, band])


def laid_out(cells: list[np.ndarray]) -> np.ndarray:
    """Cells in rows of ``COLUMNS``."""
    blank = np.full_like(cells[0], 255)
    cells = cells + [blank] * (-len(cells) % COLUMNS)
    rows = [np.concatenate(cells[k : k + COLUMNS], axis=1) for k in range(0, len(cells), COLUMNS)]
    return np.concatenate(rows)


if __name__ == "__main__":
    main(Path(sys.argv[1]), tuple(sys.argv[2:]))
