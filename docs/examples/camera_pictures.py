"""One moment of one life as every kind of camera sees it: 360, security, Kinect v2's depth camera, from above.

    python camera_pictures.py OUT [SCENE]               OUT/cameras.jpg

A room of ``activity-360`` and two people in it; each camera is placed by its own rules.
"""

from __future__ import annotations

import sys
from pathlib import Path

import cv2
import numpy as np

from hsbench.geometry.cameras import TopDownCamera
from hsbench.geometry.transforms import invert
from hsbench.io.frame_store import Film
from hsbench.schema.episode import NS_PER_S
from hsbench.schema.scene import Scene
from hsbench.schema.sensor import Sensor
from hsbench.synth.activities import Life, LifeConfig, live
from hsbench.synth.assemble import poses_in, scene_in
from hsbench.synth.film import Filming, room_lighting
from hsbench.synth.furniture import COMMON_FAMILIES
from hsbench.synth.placement import CAMERAS, SphereConfig, place_camera, place_sphere
from hsbench.synth.render import open_renderer
from hsbench.synth.rooms import RoomConfig, build_scene
from hsbench.synth.seeds import Seeds
from hsbench.typing import FloatArray, UInt8Array

LIFE = LifeConfig(duration_s=60.0, fps=10, people=2, from_outside=False, arrival_s=(2.0, 4.0))
MOMENT_NS = 45 * NS_PER_S
PLAN = Sensor("topdown", TopDownCamera(512, 512, 0.015), None)
QUALITY = 86


def picture(scene: Scene, life: Life, scene_T_episode: FloatArray, sensor: Sensor) -> UInt8Array:
    """(h, w, 3) sRGB of the moment."""
    episode_T_scene = invert(scene_T_episode)
    scene, poses = scene_in(episode_T_scene, scene), poses_in(episode_T_scene, life.poses)
    lights = room_lighting(scene, sensor.world_T_camera[:2, 3])
    filming = Filming(scene, life.bodies, poses, sensor, open_renderer(), lights, life.motions, life.held)
    background = filming.background()
    times = np.array([MOMENT_NS])
    return Film(background, times, lambda _: filming.patch(background, MOMENT_NS), 0, "none").picture(0).rgb


def main(out: Path, number: int) -> None:
    """Write the sheet: 360 above, the others below."""
    seeds = Seeds(0).child("scene").child(number)
    scene = build_scene(f"scene-{number:06d}", seeds.child("room"), RoomConfig(), COMMON_FAMILIES)
    life = live(scene, seeds.child("life"), LIFE)
    middle, sphere = place_sphere(scene, SphereConfig(1536), seeds.rng("sphere"))
    rows = [picture(scene, life, middle, sphere)]
    others = []
    for kind, name in (("monocular", "security"), ("rgbd", "kinect-v2")):
        pose, sensor = place_camera(kind, scene, CAMERAS[name], seeds.rng(name))
        others.append(cv2.resize(picture(scene, life, pose, sensor), (512, 416), interpolation=cv2.INTER_AREA))
    others.append(picture(scene, life, middle, PLAN)[48:464])
    sheet = np.vstack([*rows, np.hstack(others)])
    out.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(out / "cameras.jpg"), sheet[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, QUALITY])


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 8)
