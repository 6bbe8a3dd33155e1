"""The worked example of docs/annotate.md: labels drawn in one frame of a time-lapse, carried over to another day.

    python annotate_timelapse.py OUT                    OUT/data, OUT/annotate.jpg

Two days of a security camera in a generated room, stored as captures; on the second day it was turned by nine degrees.
The polygons of annotate_labels.json were drawn by hand in the fourth frame of the first day. How well labels are
carried over is also told by exact truth: that of the first day, carried over, against that of the second.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import cv2
import numpy as np

from hsbench.cli.main import run
from hsbench.datasets.annotation.backgrounds import background_rgb
from hsbench.datasets.annotation.homography import estimate
from hsbench.datasets.annotation.label_files import of_picture, read_labels
from hsbench.datasets.annotation.labels import NAMES, bits_of
from hsbench.datasets.annotation.overlay import overlaid
from hsbench.datasets.annotation.view import carried
from hsbench.datasets.dataset import load
from hsbench.datasets.importers.capture_set import add_captures
from hsbench.geometry.transforms import apply, invert, planar
from hsbench.io.frame_store import Film
from hsbench.schema.episode import NS_PER_S, Episode, Frame, FrameList
from hsbench.schema.motions import ObjectMotions
from hsbench.schema.occupancy import VIEW_UNSCORED
from hsbench.schema.scene import Scene
from hsbench.schema.sensor import Sensor
from hsbench.schema.states import Affordance
from hsbench.synth.activities import Life, LifeConfig, live
from hsbench.synth.assemble import poses_in, scene_in
from hsbench.synth.film import Filming, room_lighting
from hsbench.synth.furniture import COMMON_FAMILIES
from hsbench.synth.placement import CAMERAS, place_camera
from hsbench.synth.render import open_renderer
from hsbench.synth.rooms import RoomConfig, build_scene
from hsbench.synth.seeds import Seeds
from hsbench.truth.view_affordance import view_affordance
from hsbench.typing import FloatArray, UInt8Array

HERE = Path(__file__).parent
ROOM = 8
LIFE = LifeConfig(duration_s=60.0, fps=10, people=2, from_outside=False, arrival_s=(2.0, 4.0))
DAYS_S = {"day-1": (25.0, 30.0, 35.0, 45.0, 55.0), "day-2": (20.0, 28.0, 38.0, 48.0, 58.0)}
LABELLED = 3  # frame of the first day
TURN_RAD = math.radians(-9.0)
COMPARED = (Affordance.WALKABLE, Affordance.SITTABLE, Affordance.SUPPORTABLE)
QUALITY = 88


def day(name: str, scene: Scene, life: Life, scene_T_episode: FloatArray, sensor: Sensor) -> tuple[Episode, UInt8Array]:
    """A capture of five moments, and the exact labels of its view."""
    episode_T_scene = invert(scene_T_episode)
    scene, poses = scene_in(episode_T_scene, scene), poses_in(episode_T_scene, life.poses)
    lights = room_lighting(scene, sensor.world_T_camera[:2, 3])
    filming = Filming(scene, life.bodies, poses, sensor, open_renderer(), lights, life.motions, life.held)
    background = filming.background()
    times = np.array([round(s * NS_PER_S) for s in DAYS_S[name]])
    film = Film(background, times, lambda k: filming.patch(background, int(times[k])), 0, "none")
    frames = tuple(Frame(k * NS_PER_S, film.picture(k).rgb) for k in range(len(times)))
    end_ns = (len(times) - 1) * NS_PER_S
    exact = view_affordance(scene, sensor.camera, sensor.world_T_camera, ObjectMotions.none(), 0, 0)  # type: ignore[arg-type]
    return Episode(name, "lab", sensor, FrameList(frames), None, 0, end_ns), exact


def agreement(a: UInt8Array, b: UInt8Array) -> dict[str, float]:
    """Intersection over union of each affordance, where both are scored."""
    scored = (a | b) & VIEW_UNSCORED == 0
    found = {}
    for kind in COMPARED:
        one, other = (((x >> kind & 1) > 0) & scored for x in (a, b))
        found[kind.name.lower()] = float((one & other).sum() / (one | other).sum())
    return found


def main(out: Path) -> None:
    """Film, annotate, draw, and say how well the labels were carried over."""
    seeds = Seeds(0).child("scene").child(ROOM)
    scene = build_scene(f"scene-{ROOM:06d}", seeds.child("room"), RoomConfig(), COMMON_FAMILIES)
    life = live(scene, seeds.child("life"), LIFE)
    pose, sensor = place_camera("monocular", scene, CAMERAS["security"], seeds.rng("security"))
    turned = pose @ planar(0.0, 0.0, TURN_RAD)
    assert np.allclose(apply(turned, np.zeros(3)), apply(pose, np.zeros(3)))  # about its centre: a homography is exact
    first, exact_first = day("day-1", scene, life, pose, sensor)
    second, exact_second = day("day-2", scene, life, turned, sensor)
    add_captures(out / "data", [first, second])
    drawn, names = HERE / "annotate_labels.json", HERE / "annotate_names.json"
    where = ["--data", str(out / "data"), "--episode", "day-1", "--to", "day-2", "--frame", str(LABELLED)]
    assert run(["annotate", "view", str(drawn), "--labels", str(names), *where]) == 0

    picture = first.frames[LABELLED].rgb
    assert picture is not None
    found = estimate(picture, background_rgb(second), first.sensor.camera, second.sensor.camera)
    exact = of_picture(exact_first, "day-1")
    told = agreement(carried(exact, bits_of(exact, NAMES, "day-1"), found), exact_second)
    print("exact labels carried over, IoU with exact labels:", {name: round(iou, 3) for name, iou in told.items()})

    views = []
    for episode in load(out / "data", truth=True):
        rgb = picture if episode.episode_id == "day-1" else background_rgb(episode)
        assert episode.truth is not None
        assert episode.truth.view_affordance is not None
        views.append(overlaid(rgb, episode.truth.view_affordance))
    for points in (p for region in read_labels(drawn).regions for p in region.polygons_px):
        for u, v in np.round(points).astype(int).tolist():
            cv2.circle(views[0], (u, v), 3, (255, 255, 255), -1, cv2.LINE_AA)
    sheet = np.hstack([views[0], np.full((views[0].shape[0], 8, 3), 255, np.uint8), views[1]])
    cv2.imwrite(str(out / "annotate.jpg"), sheet[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, QUALITY])


if __name__ == "__main__":
    main(Path(sys.argv[1]))
