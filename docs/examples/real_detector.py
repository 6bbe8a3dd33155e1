"""Does a detector made for photographs find our people? Two steps, in two environments.

    python real_detector.py render OUT           with hsbench[gen]: crops of people and their true joints
    python real_detector.py detect OUT           with mediapipe 0.10.21 and nothing of hsbench: the table

Frames come from simulated lives in furnished rooms: one person, 2-5 m away, wholly in the picture, nothing before them.
As many frames are taken of each of 3 postures x 8 headings, of each at most one a life; people who sit with their back
to the camera are rare, for chairs hide them. The error of a joint is its distance in the picture, in metres at the
joint's true depth; hsbench's joints lie inside limbs, where the detector was taught to put them too.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import cv2
import numpy as np

JOINTS = tuple(
    f"{name}_{side}" for name in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle") for side in ("left", "right")
)
BLAZEPOSE = (11, 12, 13, 14, 15, 16, 23, 24, 25, 26, 27, 28)  # landmarks of the same joints
POSTURES = ("walking", "standing", "sitting")
HEADINGS = 8  # towards the camera, and every 45 degrees
EACH = 8  # frames a posture and heading
DISTANCE_M = (2.0, 5.0)
WALKS_M_S, STANDS_M_S = 0.5, 0.05
MARGIN = 0.15  # of the person's size, around the crop
CROP_PX = 256  # shorter side at least
MOST_ROOMS = 120


def render(out: Path) -> None:
    """Write crops and truth of the frames wanted, from as many rooms as it takes."""
    out.mkdir(parents=True, exist_ok=True)
    wanted = {(posture, heading): EACH for posture in POSTURES for heading in range(HEADINGS)}
    records: list[dict[str, object]] = []
    for number in range(MOST_ROOMS):
        if not any(wanted.values()):
            break
        for crop, record in frames_of_room(number, wanted):
            record["file"] = f"{len(records):04d}.png"
            cv2.imwrite(str(out / str(record["file"])), crop[:, :, ::-1])
            records.append(record)
        print(f"room {number}: {len(records)} frames", flush=True)
    (out / "truth.json").write_text(json.dumps(records, indent=1), encoding="utf-8")


def frames_of_room(number: int, wanted: dict[tuple[str, int], int]):  # type: ignore[no-untyped-def]
    """(crop, record) of the wanted frames of one life in one room; takes them off ``wanted``."""
    from hsbench.geometry.rays import pack_solids, segments_blocked
    from hsbench.geometry.transforms import invert
    from hsbench.schema import KINECT_V2
    from hsbench.schema.scene import PERSON_ID_OFFSET
    from hsbench.synth.activities import LifeConfig, live
    from hsbench.synth.assemble import poses_in, scene_in
    from hsbench.synth.film import Filming, room_lighting
    from hsbench.synth.furniture import COMMON_FAMILIES
    from hsbench.synth.placement import CameraConfig, place_rgbd
    from hsbench.synth.render import open_renderer
    from hsbench.synth.rooms import RoomConfig, build_scene
    from hsbench.synth.seeds import Seeds

    seeds = Seeds(2024).child(number)
    scene = build_scene("x", seeds.child("room"), RoomConfig(width_m=(4.5, 6.0), depth_m=(4.5, 6.0)), COMMON_FAMILIES)
    life = live(scene, seeds.child("life"), LifeConfig(duration_s=120.0))
    scene_T_episode, sensor = place_rgbd(scene, CameraConfig(), seeds.rng("camera"))
    episode_T_scene = invert(scene_T_episode)
    scene, poses = scene_in(episode_T_scene, scene), poses_in(episode_T_scene, life.poses)
    if not life.bodies or poses.joints_m is None:
        return
    names = KINECT_V2.names
    joints = poses.joints_m.astype(np.float64)
    pixels, depth = sensor.camera.project(apply_(invert(sensor.world_T_camera), joints))
    speed = np.linalg.norm(np.gradient(joints[:, 0, :2], axis=0), axis=1) * 30.0
    shoulders = joints[:, names.index("shoulder_left"), :2] - joints[:, names.index("shoulder_right"), :2]
    facing = np.arctan2(-shoulders[:, 0], shoulders[:, 1])
    to_camera = np.arctan2(-joints[:, 0, 1], -joints[:, 0, 0])
    heading = np.round(np.mod(facing - to_camera, 2 * np.pi) / (2 * np.pi / HEADINGS)).astype(int) % HEADINGS
    packed = pack_solids([s for item in scene.objects for s in item.solids])
    filming, background, taken = None, None, set()
    for row in np.argsort(np.random.default_rng(number).random(len(joints))):
        posture = ("", "walking" if speed[row] > WALKS_M_S else "standing" if speed[row] < STANDS_M_S else "",
                   "sitting", "")[int(life.action[row])]  # fmt: skip
        key = (posture, int(heading[row]))
        distance = float(np.linalg.norm(joints[row, 0]))
        if not wanted.get(key) or not DISTANCE_M[0] <= distance <= DISTANCE_M[1] or key in taken:
            continue
        if not sensor.camera.contains(pixels[row]).all():
            continue
        if segments_blocked(sensor.world_T_camera[:3, 3], joints[row], packed).any():
            continue
        if filming is None:
            lights = room_lighting(scene, sensor.world_T_camera[:2, 3])
            filming = Filming(scene, life.bodies, poses, sensor, open_renderer("auto"), lights)
            background = filming.background()
        patch = filming.patch(background, int(poses.timestamp_ns[row]))
        rgb = background.rgb.copy()
        window = rgb[patch.row : patch.row + patch.mask.shape[0], patch.column : patch.column + patch.mask.shape[1]]
        window[patch.mask] = patch.picture.rgb[patch.mask]
        v, u = np.nonzero(patch.mask & (patch.picture.instance > PERSON_ID_OFFSET))
        if not len(v):
            continue
        low, high = np.array([u.min(), v.min()]), np.array([u.max(), v.max()]) + 1
        pad = MARGIN * (high - low).max()
        low = np.maximum(np.floor(low + (patch.column, patch.row) - pad), 0).astype(int)
        high = np.minimum(np.ceil(high + (patch.column, patch.row) + pad), rgb.shape[1::-1]).astype(int)
        crop = rgb[low[1] : high[1], low[0] : high[0]]
        scale = max(1.0, CROP_PX / min(crop.shape[:2]))
        crop = cv2.resize(crop, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC)
        rows = [names.index(name) for name in JOINTS]
        wanted[key] -= 1
        taken.add(key)
        yield crop, {
            "posture": posture, "heading": key[1], "distance_m": distance,
            "joints_px": ((pixels[row, rows] - low) * scale).round(2).tolist(),
            "m_per_px": (depth[row, rows] / (sensor.camera.fx_px * scale)).round(7).tolist(),
        }  # fmt: skip


def apply_(a_T_b: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(..., 3) points moved by a rigid transform (4, 4)."""
    return np.asarray(points @ a_T_b[:3, :3].T + a_T_b[:3, 3])


def detect(out: Path) -> None:
    """Run BlazePose on the crops and print who was found and how far the joints are off."""
    import mediapipe

    records = json.loads((out / "truth.json").read_text(encoding="utf-8"))
    found, errors = [], []
    with mediapipe.solutions.pose.Pose(static_image_mode=True, model_complexity=1) as detector:
        for record in records:
            bgr = cv2.imread(str(out / record["file"]))
            answer = detector.process(bgr[:, :, ::-1].copy()).pose_landmarks
            found.append(answer is not None)
            if answer is not None:
                px = np.array([[answer.landmark[k].x, answer.landmark[k].y] for k in BLAZEPOSE])
                off = np.linalg.norm(px * bgr.shape[1::-1] - record["joints_px"], axis=1)
                errors.append(off * record["m_per_px"])
            else:
                errors.append(np.full(len(JOINTS), np.nan))
    print_table(records, np.array(found), np.array(errors))


def print_table(records: list[dict[str, object]], found: np.ndarray, errors: np.ndarray) -> None:
    """Found people and median error by posture, heading and joint."""
    print(f"{'frames':24s} {'n':>4s} {'found':>7s} {'median error':>13s}")
    groups = {"all": np.ones(len(records), dtype=bool)}
    for key in ("posture", "heading"):
        values = [r[key] for r in records]
        for value in dict.fromkeys(values if key == "posture" else range(HEADINGS)):
            groups[f"{key} {value}"] = np.array([v == value for v in values])
    for name, rows in groups.items():
        share, error = found[rows].mean(), np.nanmedian(errors[rows]) if found[rows].any() else np.nan
        print(f"{name:24s} {rows.sum():4d} {100 * share:6.1f}% {100 * error:10.1f} cm")
    for k, name in enumerate(JOINTS):
        print(f"{name:24s} {len(records):4d} {'':7s} {100 * np.nanmedian(errors[:, k]):10.1f} cm")


if __name__ == "__main__":
    {"render": render, "detect": detect}[sys.argv[1]](Path(sys.argv[2]))
