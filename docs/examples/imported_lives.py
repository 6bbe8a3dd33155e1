"""Let people live in an imported scene, and look at what they do.

    hsbench import scene room.glb --labels labels.json --out room
    python docs/examples/imported_lives.py room lives

Two people live there for ten minutes. Writes ``events.csv``, ``activity_map.png`` (where they stood, blue, and sat,
orange, over the floor plan) and ``frame.png`` (the moment and the corner that show most of what people do).
"""

import csv
import sys
from pathlib import Path

import numpy as np

from hsbench.geometry.activity_map import rasterise
from hsbench.geometry.cameras import PinholeCamera
from hsbench.geometry.footprints import smallest_yaw
from hsbench.geometry.transforms import apply, invert, planar
from hsbench.io.images import write_png
from hsbench.io.scene_folder import read_scene
from hsbench.schema.poses import PoseTable
from hsbench.schema.scene import Scene
from hsbench.schema.sensor import Sensor
from hsbench.schema.states import Action
from hsbench.synth.activities import Life, LifeConfig, live
from hsbench.synth.activities.contact import Obstacles
from hsbench.synth.film import Filming, room_lighting
from hsbench.synth.render import open_renderer
from hsbench.synth.seeds import Seeds
from hsbench.viz.pictures import SIT_TINT, STAND_TINT
from hsbench.viz.plan import plan_drawing
from hsbench.viz.plan_canvas import raster

RADIUS_M, DELTA, OPACITY, WIDTH_PX = 0.22, 1 / 900, 0.7, 900  # a spot is full after half a minute of poses
CAMERA = PinholeCamera(960, 720, 620.0, 620.0, 480.0, 360.0)
HEIGHT_M, TILT_RAD, FROM_WALL_M = 1.8, 0.3, 0.4
EVERY, SHOWN = 300, [0, 3, 13, 17]  # frames; pelvis, head and knees
VIEW_COSINE, NEAR_M, FAR_M = 0.85, 2.0, 6.0


def main(folder: Path, out: Path) -> None:
    scene = read_scene(folder)
    life = live(
        scene, Seeds(1), LifeConfig(duration_s=600.0, people=2, mode="natural", start_hour=20.0, unused_share=0.0)
    )
    out.mkdir(parents=True, exist_ok=True)
    with (out / "events.csv").open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(["start_s", "end_s", "person", "activity", "object", "part", "contact"])
        rows.writerows(event_rows(scene, life))
    write_png(out / "activity_map.png", activity_map(scene, life))
    write_png(out / "frame.png", frame(scene, life))


def event_rows(scene: Scene, life: Life) -> list[list[object]]:
    """One row an event."""
    e = life.events
    names = [scene.object(int(i)).category_name if i > 0 else "" for i in e.object_id]
    times = np.round(np.stack([e.start_ns, e.end_ns]) / 1e9, 2)
    return [list(row) for row in zip(*times, e.person_id, e.activity, names, e.part, e.contact, strict=True)]


def activity_map(scene: Scene, life: Life):
    """(h, w, 3) the plan, tinted where the pelvises were of those who sat and of the others."""
    drawing = plan_drawing(scene)
    picture = raster(drawing, WIDTH_PX).astype(np.float64)
    cell_m = float(drawing.high[0] - drawing.low[0]) / WIDTH_PX
    turn = planar(0.0, 0.0, -smallest_yaw(np.concatenate([room.outline_xy for room in scene.rooms]), 0.0))
    pelvis = apply(turn, life.poses.joints_m[:, 0].astype(np.float64))[:, :2]
    sitting = life.action == Action.SIT
    for rows, tint in ((~sitting, STAND_TINT), (sitting, SIT_TINT)):
        shape = (WIDTH_PX, picture.shape[0])
        weight = rasterise(pelvis[rows], tuple(drawing.low), shape, cell_m, RADIUS_M, DELTA)
        share = OPACITY * weight.T[::-1, :, None]
        picture = (1 - share) * picture + share * np.array(tint)
    return picture.round().astype(np.uint8)


def frame(scene: Scene, life: Life):
    """(h, w, 3) the moment and the view that show most joints, those of people who do something twice."""
    room = max(scene.rooms, key=lambda room: room.area_m2).outline_xy
    middle = (room.min(axis=0) + room.max(axis=0)) / 2
    corners = np.concatenate([room, (room + np.roll(room, 1, axis=0)) / 2])
    cameras = corners + FROM_WALL_M * np.sign(middle - corners)
    obstacles, best = Obstacles.of(scene), (0, 0, cameras[0], np.zeros(2))
    for moment in np.unique(life.poses.timestamp_ns)[::EVERY]:
        rows = np.flatnonzero(life.poses.timestamp_ns == moment)
        joints = life.poses.joints_m[rows].astype(np.float64)
        worth = np.where(life.action[rows] == Action.STAND, 1, 2)
        target = joints[:, 0, :2].mean(axis=0)
        for camera in cameras:
            eye, ahead = np.append(camera, HEIGHT_M), target - camera
            away = joints[:, 0, :2] - camera
            inside = away @ ahead > VIEW_COSINE * np.linalg.norm(away, axis=1) * np.linalg.norm(ahead)
            inside &= (np.linalg.norm(away, axis=1) > NEAR_M) & (np.linalg.norm(away, axis=1) < FAR_M)
            seen = [sum(not obstacles.block(eye, joint) for joint in person[SHOWN]) for person in joints]
            score = int((worth * inside * seen).sum())
            if score > best[0]:
                best = (score, int(moment), camera, ahead)
    _, moment, camera, ahead = best
    episode_T_scene = invert(planar(*camera, float(np.arctan2(ahead[1], ahead[0]))))
    return film(scene.moved(episode_T_scene), life, moved(life.poses, episode_T_scene), moment)


def film(scene: Scene, life: Life, poses: PoseTable, moment_ns: int):
    sensor = Sensor("rgbd", CAMERA, HEIGHT_M, TILT_RAD)
    lights = room_lighting(scene, sensor.world_T_camera[:2, 3])
    filming = Filming(scene, life.bodies, poses, sensor, open_renderer("raycast"), lights, life.motions)
    picture = filming.background()
    patch = filming.patch(picture, moment_ns)
    rgb = picture.rgb.copy()
    rows, columns = patch.mask.shape
    window = rgb[patch.row : patch.row + rows, patch.column : patch.column + columns]
    window[patch.mask] = patch.picture.rgb[patch.mask]
    return rgb


def moved(poses: PoseTable, b_T_a: np.ndarray) -> PoseTable:
    joints = poses.joints_m @ b_T_a[:3, :3].T + b_T_a[:3, 3]
    return PoseTable(poses.skeleton, poses.timestamp_ns, poses.track_id, poses.joint_state, joints.astype(np.float32))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
