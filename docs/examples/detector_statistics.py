"""What the presets of the pose detector give of simulated lives. Usage: detector_statistics.py [ROOMS]

In each room one person lives ten minutes before a camera on a wall; detectors in metres look 30 times a second, those
in pixels 10 times. A person is there while a clean detector finds them. AP is COCO's (over OKS thresholds .5, .55 ...
.95) of visible joints, were right detections ranked first: then it is recall. A joint that is not answered scores 0.
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np

from hsbench.geometry.transforms import apply, invert
from hsbench.schema import JointState, PoseTable, Scene, Sensor
from hsbench.schema.skeletons import KINECT_V2, SKELETONS
from hsbench.synth.activities import Life, LifeConfig, live
from hsbench.synth.assemble import poses_in, scene_in
from hsbench.synth.detectors import PRESETS, DetectorConfig, Occluders, observe
from hsbench.synth.detectors.image import ROOT_AREA, shares
from hsbench.synth.furniture import COMMON_FAMILIES
from hsbench.synth.placement import CameraConfig, place_rgbd
from hsbench.synth.rooms import RoomConfig, build_scene
from hsbench.synth.seeds import Seeds

DURATION_S = 600.0
THRESHOLDS = np.arange(0.5, 0.96, 0.05)
Figures = dict[str, float]


def main(rooms: int) -> None:
    """Print a line for each preset: means over the rooms."""
    found: dict[str, list[Figures]] = {name: [] for name in PRESETS}
    for number in range(rooms):
        seeds = Seeds(0).child(number)
        scene = build_scene(f"scene-{number:06d}", seeds.child("room"), RoomConfig(), COMMON_FAMILIES)
        life = live(scene, seeds.child("life"), LifeConfig(duration_s=DURATION_S))
        scene_T_episode, sensor = place_rgbd(scene, CameraConfig(), seeds.rng("camera"))
        inverse = invert(scene_T_episode)
        room, true = scene_in(inverse, scene), poses_in(inverse, life.poses)
        for name, config in PRESETS.items():
            found[name].append(figures(room, life, true, sensor, config, seeds.child(name)))
    for name, table in found.items():
        print(f"{name}: " + ", ".join(f"{key} {np.nanmean([t[key] for t in table]):.3g}" for key in table[0]))


def figures(scene: Scene, life: Life, true: PoseTable, sensor: Sensor, config: DetectorConfig, seeds: Seeds) -> Figures:
    """The figures of one detector and one life, both in the episode frame."""
    clean = replace(
        PRESETS["clean"], skeleton=config.skeleton, range_m=config.range_m, least_tracked=config.least_tracked
    )
    times = np.unique(true.timestamp_ns)[:: 1 if config.in_metres else 3]
    occluders = Occluders.of(scene, life.motions)
    truth, rows = observe(true, life.bodies, occluders, sensor, clean, seeds, times)
    observed, match = observe(true, life.bodies, occluders, sensor, config, seeds, times)
    real = match >= 0
    there = np.searchsorted(rows, match[real])
    minutes = DURATION_S / 60.0
    table = {f"{s.name.lower()} %": 100 * float((observed.joint_state[real] == s).mean()) for s in JointState}
    table["found %"] = 100 * float(real.sum()) / len(truth)
    table["phantoms a minute"] = len(np.unique(observed.track_id[~real])) / minutes
    table["tracks a minute"] = len(np.unique(observed.track_id[real])) / minutes
    if config.in_metres:
        error = np.linalg.norm(observed.joints_m[real] - truth.joints_m[there], axis=-1)
        for state in (JointState.TRACKED, JointState.INFERRED):
            table[f"{state.name.lower()}: mm"] = 1000 * float(np.median(error[observed.joint_state[real] == state]))
        return table
    similarity = object_similarity(life, true, sensor, observed.select(real), truth.select(there), rows[there])
    recall = (similarity > THRESHOLDS[:, None]).sum(axis=1) / len(truth)
    return table | {
        "OKS": float(similarity.mean()),
        "AP": float(recall.mean()),
        "AP50": float(recall[0]),
        "AP75": float(recall[5]),
    }


def object_similarity(
    life: Life, true: PoseTable, sensor: Sensor, found: PoseTable, truth: PoseTable, rows: np.ndarray
) -> np.ndarray:
    """(M,) COCO's object keypoint similarity over visible joints; true rows of the poses found and of clean ones."""
    pelvis = true.joints_m[rows, KINECT_V2.index("spine_base")].astype(np.float64)
    depth_m = apply(invert(sensor.world_T_camera), pelvis)[:, 2]
    stature_m = np.array([body.stature_m for body in life.bodies])[true.track_id[rows] - 1]
    root_area_px = ROOT_AREA * sensor.camera.fx_px * stature_m / depth_m
    sigma = shares(SKELETONS[found.skeleton]) * np.sqrt(2.0) / ROOT_AREA
    apart = ((found.joints_px - truth.joints_px) ** 2).sum(axis=-1)
    similar = np.exp(-apart / (2 * (2 * sigma) ** 2 * root_area_px[:, None] ** 2))
    visible = truth.joint_state == JointState.TRACKED
    return np.where(visible, np.nan_to_num(similar), 0.0).sum(axis=1) / visible.sum(axis=1)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10)
