"""How good lives are: what is promised of them, counted over many scenes.

Sums are kept, so that scenes are pooled by adding them up. ``docs/examples/life_statistics.py`` prints the table.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numba
import numpy as np

from hsbench.geometry.capsules import segment_hits
from hsbench.geometry.transforms import apply, invert
from hsbench.schema.episode import NS_PER_S
from hsbench.schema.motions import scene_at
from hsbench.schema.scene import Part, Scene, SceneObject
from hsbench.synth.activities.contact import Obstacles, body_depth
from hsbench.synth.activities.diary import CONTACTS
from hsbench.synth.activities.life import Life
from hsbench.synth.activities.mesh_contact import first_hit
from hsbench.synth.people import body as anatomy
from hsbench.synth.people.body import J, capsules
from hsbench.synth.people.joint_limits import limit_violations
from hsbench.synth.survey import Promise
from hsbench.truth.sittable import SEAT_ROLES
from hsbench.typing import BoolArray, FloatArray, IntArray

DEEP_M = 0.03  # deeper is a penetration
EVERY = 5  # poses are compared with furniture and each other at every so many frames
CLOSE_M = 1.8  # bodies whose pelvises are farther apart do not meet
ON_FLOOR_M = 0.004  # a ball of a foot so little above its rest stands
STEP_FRAMES = 5  # a foot stands for at least so many frames
MOVING_M_S = 0.1  # who is slower does not walk
WALK_M = 1.0  # shorter walks have no speed of their own
SITTING = ("sit_down", "sit", "stand_up", "sleep", "nap")
FASTER = 300.0


@dataclass(frozen=True)
class Measures:
    """Counts and samples of one or more lives.

    seconds: of life; lived_s: of computing it. frames: poses compared; deep: of these, those that reach more than
    ``DEEP_M`` into furniture or walls; deep_in: by
    what the person does. pairs, met: two bodies compared at a time, and those that reach into each other.
    slide_m: of each standing foot. seat_error_m: pelvis against its seat, each sit's worst. speed_m_s: mean of each
    walk. over_limit: poses that break a joint limit, of all ``poses``. stuck_s: longest wait of each person.
    contacts, atypical: sits and touches, and sits on what is no seat. events: how often each activity was done.
    """

    seconds: float = 0.0
    lived_s: float = 0.0
    poses: int = 0
    frames: int = 0
    deep: int = 0
    deep_in: tuple[tuple[str, int], ...] = ()
    pairs: int = 0
    met: int = 0
    slide_m: tuple[float, ...] = ()
    seat_error_m: tuple[float, ...] = ()
    speed_m_s: tuple[float, ...] = ()
    over_limit: int = 0
    stuck_s: tuple[float, ...] = ()
    contacts: int = 0
    atypical: int = 0
    events: tuple[tuple[str, int], ...] = ()
    undone: tuple[tuple[str, int], ...] = ()

    def __add__(self, other: Measures) -> Measures:
        joined = {f.name: getattr(self, f.name) + getattr(other, f.name) for f in fields(self)}
        for name in ("deep_in", "events", "undone"):
            joined[name] = _counted([key for key, count in joined[name] for _ in range(count)])
        return Measures(**joined)


def measure(scene: Scene, life: Life) -> Measures:
    """All measures of a life in a scene; at least one person lives there."""
    joints = _joints(life)
    seconds = float(life.poses.timestamp_ns[-1] - life.poses.timestamp_ns[0]) / NS_PER_S
    doing = _doing(life)
    deep = _deep(scene, life, joints, doing)
    pairs, met = _meetings(life, joints)
    used = [k for k, contact in enumerate(life.events.contact) if contact]
    return Measures(
        seconds=seconds,
        poses=len(joints),
        frames=len(deep),
        deep=sum(deep.values()),
        deep_in=_counted([doing[row] for row, is_deep in deep.items() if is_deep]),
        pairs=pairs,
        met=met,
        slide_m=tuple(_slides(life, joints)),
        seat_error_m=tuple(_seat_errors(scene, life, joints)),
        speed_m_s=tuple(_speeds(life, joints)),
        over_limit=int((limit_violations(joints).reshape(len(joints), -1) > 0).any(axis=1).sum()),
        stuck_s=tuple(_waits(life)),
        contacts=sum(life.events.activity[k] in CONTACTS for k in used),
        atypical=sum(_is_atypical(scene, life, k) for k in used),
        events=_counted(life.events.activity),
        undone=_counted([f"{activity}: {_general(reason)}" for _, activity, reason in life.undone]),
    )


def _joints(life: Life) -> FloatArray:
    assert life.poses.joints_m is not None
    return life.poses.joints_m.astype(np.float64)


def _rows(life: Life, event: int) -> IntArray:
    """Rows of the poses of an event."""
    events, times = life.events, life.poses.timestamp_ns
    low, high = np.searchsorted(times, [events.start_ns[event], events.end_ns[event] + 1])
    return low + np.flatnonzero(life.poses.track_id[low:high] == events.person_id[event])


def _doing(life: Life) -> list[str]:
    """For each pose the name of the event that began last."""
    names = [""] * len(life.poses)
    for event, name in enumerate(life.events.activity):
        for row in _rows(life, event).tolist():
            names[row] = name
    return names


def _deep(scene: Scene, life: Life, joints: FloatArray, doing: list[str]) -> dict[int, bool]:
    """For each pose that is compared, whether it reaches too deep into anything."""
    used = np.full(len(joints), -1, dtype=np.int64)
    for event, name in enumerate(life.events.activity):
        if name in SITTING:
            used[_rows(life, event)] = life.events.object_id[event]
    found: dict[int, bool] = {}
    there: dict[tuple[object, ...], Obstacles] = {}
    for row in range(0, len(joints), EVERY):
        moves = life.motions.moves_at(int(life.poses.timestamp_ns[row]))
        key = tuple(sorted(moves.items()))
        if key not in there:
            there[key] = Obstacles.of(scene_at(scene, moves))
        body = life.bodies[int(life.poses.track_id[row]) - 1]
        depth = body_depth(there[key], body, joints[row : row + 1], int(used[row]))
        found[row] = bool((depth > DEEP_M).any())
    return found


def _meetings(life: Life, joints: FloatArray) -> tuple[int, int]:
    """How often two bodies are compared, and reach too deep into each other."""
    times, ids = life.poses.timestamp_ns, life.poses.track_id
    pairs = met = 0
    for first in _moments(times)[::EVERY]:
        rows = np.flatnonzero(times[first : first + len(life.bodies)] == times[first]) + first
        shapes = [capsules(life.bodies[int(ids[row]) - 1], joints[row : row + 1]) for row in rows]
        for a in range(len(rows)):
            for b in range(a):
                pairs += 1
                if np.sum((joints[rows[a], 0, :2] - joints[rows[b], 0, :2]) ** 2) < CLOSE_M**2:
                    met += int(_meet(shapes[a][0][0], shapes[a][1], shapes[b][0][0], shapes[b][1], DEEP_M))
    return pairs, met


def _moments(times: IntArray) -> IntArray:
    """First row of each time."""
    return np.flatnonzero(np.append(True, np.diff(times) > 0))


@numba.njit(cache=True)
def _meet(ends_a: FloatArray, radii_a: FloatArray, ends_b: FloatArray, radii_b: FloatArray, depth: float) -> bool:
    """Whether capsules (C, 2, 3) with radii (C, 2) reach into others by more than a depth, with a's thinner radius."""
    for i in range(len(ends_a)):
        grown = radii_a[i].min() - depth
        for j in range(len(ends_b)):
            near, far = radii_b[j, 0] + grown, radii_b[j, 1] + grown
            if min(near, far) > 0.0 and segment_hits(ends_a[i, 0], ends_a[i, 1], ends_b[j, 0], ends_b[j, 1], near, far):
                return True
    return False


def _slides(life: Life, joints: FloatArray) -> list[float]:
    """How far each ball of a foot moves while it stands during a walk, metres."""
    found = []
    for event, name in enumerate(life.events.activity):
        if name in ("walk", "explore"):
            rows = _rows(life, event)
            body = life.bodies[int(life.events.person_id[event]) - 1]
            for side in ("left", "right"):
                ball = joints[rows, J[f"foot_{side}"]]
                down = ball[:, 2] <= body.of_stature(anatomy.BALL_HEIGHT) + ON_FLOOR_M
                for first, stop in _runs(down):
                    if stop - first >= STEP_FRAMES:
                        away = ball[first:stop, :2] - ball[first, :2]
                        found.append(float(np.sqrt(np.sum(away**2, axis=1)).max()))
    return found


def _runs(flags: BoolArray) -> list[tuple[int, int]]:
    """(first, stop) of each run of true flags."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _seat_errors(scene: Scene, life: Life, joints: FloatArray) -> list[float]:
    """For each sit, the worst distance of the pelvis from where its seat says: over the part, a belly above it."""
    found = []
    for event, name in enumerate(life.events.activity):
        if name == "sit":
            body = life.bodies[int(life.events.person_id[event]) - 1]
            item = scene.object(int(life.events.object_id[event]))
            part = next(p for p in item.parts if p.name == life.events.part[event])
            rows = _rows(life, event)
            pelvis, belly_m = joints[rows, J["spine_base"]], body.radius(anatomy.RADIUS_BELLY[0])
            if part.solid is None:
                found.append(_above_mesh(item, part, pelvis, belly_m))
                continue
            over = np.abs(pelvis[:, 2] - apply(item.scene_T_object, part.vertices)[:, 2].max() - belly_m)
            local = apply(invert(item.scene_T_object), pelvis)[:, :2] - _shifts(life, item.object_id, rows)
            low, high = part.vertices[:, :2].min(axis=0), part.vertices[:, :2].max(axis=0)
            aside = np.sqrt(np.sum((local - np.clip(local, low, high)) ** 2, axis=1))
            found.append(float(np.maximum(over, aside).max()))
    return found


def _shifts(life: Life, object_id: int, rows: IntArray) -> FloatArray:
    """(n, 2) how far an object is moved, in its own frame, at some rows of the poses."""
    moves = [life.motions.moves_at(int(time)) for time in life.poses.timestamp_ns[rows].tolist()]
    return np.array([move.get((object_id, ""), np.zeros(3))[:2] for move in moves]).reshape(-1, 2)


def _above_mesh(item: SceneObject, part: Part, pelvis: FloatArray, belly_m: float) -> float:
    """The worst difference of the heights (N, 3) of a pelvis above a mesh part, straight below, from a belly's."""
    hits = [first_hit(item, part, point, np.array([0.0, 0.0, -1.0])) for point in pelvis[::EVERY]]
    under = np.array([-np.inf if hit is None else hit[2] for hit in hits])
    return float(np.abs(pelvis[::EVERY, 2] - under - belly_m).max(initial=0.0))


def _speeds(life: Life, joints: FloatArray) -> list[float]:
    """Mean speed of each walk while it moves, metres a second."""
    found = []
    for event, name in enumerate(life.events.activity):
        if name in ("walk", "explore"):
            rows = _rows(life, event)
            steps = np.sqrt(np.sum(np.diff(joints[rows, J["spine_base"], :2], axis=0) ** 2, axis=1))
            times = np.diff(life.poses.timestamp_ns[rows]) / NS_PER_S
            moving = steps > MOVING_M_S * times
            if steps.sum() > WALK_M:
                found.append(float(steps[moving].sum() / times[moving].sum()))
    return found


def _waits(life: Life) -> list[float]:
    """The longest time each person waited for others, seconds."""
    longest = []
    for person in range(1, len(life.bodies) + 1):
        spans = [
            (int(life.events.start_ns[k]), int(life.events.end_ns[k]))
            for k, name in enumerate(life.events.activity)
            if name == "wait" and life.events.person_id[k] == person
        ]
        best, start, end = 0, 0, -NS_PER_S
        for first, last in spans:
            if first > end + NS_PER_S // 10:
                start = first
            end = last
            best = max(best, end - start)
        longest.append(best / NS_PER_S)
    return longest


def _is_atypical(scene: Scene, life: Life, event: int) -> bool:
    if life.events.activity[event] != "sit":
        return False
    item = scene.object(int(life.events.object_id[event]))
    return any(p.name == life.events.part[event] and p.role not in SEAT_ROLES for p in item.parts)


def _general(reason: str) -> str:
    """A reason without numbers of people and things."""
    return "".join(c for c in reason if not c.isdigit()).strip()


def _counted(names: Sequence[str]) -> tuple[tuple[str, int], ...]:
    return tuple((name, list(names).count(name)) for name in sorted(set(names)))


def promises(found: Measures) -> tuple[Promise, ...]:
    """What is promised of lives, against what was measured."""
    deep, slide = found.deep / max(found.frames, 1), float(np.median(found.slide_m or np.nan))
    seat, speed = max(found.seat_error_m, default=0.0), np.array(found.speed_m_s)
    stuck = max(found.stuck_s, default=0.0)
    atypical = found.atypical / max(found.contacts, 1)
    faster = found.seconds / found.lived_s if found.lived_s else float("nan")
    return (
        Promise("poses more than 3 cm inside furniture or walls", f"{100 * deep:.3f} %", deep < 0.005),
        Promise("pairs of people more than 3 cm inside each other", f"{found.met} of {found.pairs}", found.met == 0),
        Promise("slide of a standing foot, median of steps", f"{100 * slide:.2f} cm", slide < 0.01),
        Promise("pelvis from its seat, worst", f"{100 * seat:.1f} cm", seat < 0.03),
        Promise(
            "walking speed, least and most of walks", f"{speed.min():.2f}-{speed.max():.2f} m/s",
            bool(speed.min() >= 0.4 and speed.max() <= 1.6),
        ),
        Promise("poses that break a joint limit", f"{found.over_limit} of {found.poses}", found.over_limit == 0),
        Promise("longest wait of anybody", f"{stuck:.1f} s", stuck <= 10.0),
        Promise("contacts that are atypical", f"{100 * atypical:.1f} % of {found.contacts}", True),
        Promise("faster than life, planning included", f"{faster:.0f} times", not faster < FASTER),
    )  # fmt: skip
