"""Checks of a data set beyond the schema: do files, pictures, poses and truth tell one story?"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hsbench.datasets.dataset import Dataset
from hsbench.datasets.geometry_checks import geometry_faults, view_faults
from hsbench.errors import HsbenchError
from hsbench.geometry.cameras import CentralCamera
from hsbench.io.dataset_index import verify_files
from hsbench.schema.episode import Episode
from hsbench.schema.states import VoxelState
from hsbench.truth.sight import depth_states

__all__ = ["verify_episode", "verify_files", "verify_views"]

STATE_AGREEMENT = 0.995
"""Share of voxels in view whose state from the stored clean depth (whole millimetres) equals the stored state."""
POSE_ERROR_M = 0.25
"""Median distance of observed to true joints; a wrong frame or a wrong match is metres."""


def verify_episode(episode: Episode) -> list[str]:
    """Every fault of an episode read with truth, a line each."""
    checks = (_pictures, _states, _poses, geometry_faults)
    return [f"{episode.episode_id}: {fault}" for check in checks for fault in check(episode)]


def verify_views(dataset: Dataset) -> Iterator[list[str]]:
    """Faults among the episodes of each room that several sensors filmed; ``dataset`` was loaded with truth."""
    rooms: dict[str, list[int]] = {}
    for index, row in enumerate(dataset.rows):
        if row["n_frames"]:
            rooms.setdefault(row["scene_id"], []).append(index)
    for indices in rooms.values():
        try:
            yield list(view_faults([dataset[index] for index in indices])) if len(indices) > 1 else []
        except HsbenchError:
            yield []  # ``verify_episode`` says why it cannot be read


def _pictures(episode: Episode) -> list[str]:
    """First and last picture decode at the size the camera says."""
    camera = episode.sensor.camera
    expected = (camera.height_px, camera.width_px)
    faults = []
    for index in sorted({0, len(episode.frames) - 1}) if len(episode.frames) else ():
        frame = episode.frames[index]
        for name, image in (("rgb", frame.rgb), ("depth_m", frame.depth_m)):
            if image is not None and image.shape[:2] != expected:
                faults.append(
                    f"frame {index} {name} has size {image.shape[:2]}; expected {expected} as the camera says"
                )
    return faults


def _states(episode: Episode) -> list[str]:
    """The states stored with truth follow from the clean picture at t0."""
    truth = episode.truth
    if (
        truth is None
        or truth.occupancy is None
        or truth.frames is None
        or not isinstance(episode.sensor.camera, CentralCamera)
    ):
        return []
    depth = truth.frames[0].depth_m
    if depth is None:
        return []
    stored = truth.occupancy.state
    states = depth_states(truth.occupancy.grid, episode.sensor.camera, episode.placed_sensor.world_T_camera, depth)
    in_view = np.isin(stored, (VoxelState.FREE, VoxelState.SURFACE, VoxelState.OCCLUDED))
    if not in_view.any():
        return ["no voxel of the truth grid is in view"]
    share = float(np.mean(states[in_view] == stored[in_view]))
    if share < STATE_AGREEMENT:
        return [
            f"voxel states agree with the depth at t0 on {share:.2%}; expected {STATE_AGREEMENT:.1%} (another frame?)"
        ]
    return []


def _poses(episode: Episode) -> list[str]:
    """Observed poses lie where their true matches are."""
    truth, observed = episode.truth, episode.poses
    if truth is None or truth.poses is None or observed is None or observed.joints_m is None:
        return []
    matched = np.flatnonzero(truth.poses.match >= 0)
    true = truth.poses.poses.joints_m
    if not len(matched) or true is None:
        return []
    rows = truth.poses.match[matched]
    if (truth.poses.poses.timestamp_ns[rows] != observed.timestamp_ns[matched]).any():
        return ["an observed pose is matched to a true pose of another time"]
    error = np.linalg.norm(observed.joints_m[matched] - true[rows], axis=-1)
    median = float(np.nanmedian(error))
    return (
        [f"observed joints lie {median:.2f} m from the true ones (median); expected < {POSE_ERROR_M} m"]
        if median > POSE_ERROR_M
        else []
    )
