"""A submission: everything behind a visible surface is solid. Usage: make_submission.py DATA_FOLDER OUT_FOLDER"""

import sys

import numpy as np

import hsbench
from hsbench.schema import VoxelState
from hsbench.submission import Metadata, SubmissionWriter
from hsbench.tasks import task
from hsbench.truth.sight import depth_states

spec = task("scene-completion")
about = Metadata(spec.name, spec.version, "behind-surface", track="frames", authors=("A. Reader",))
with SubmissionWriter(sys.argv[2], spec, about, replace=True) as out:
    for episode in hsbench.load(sys.argv[1], "val"):
        sensor, depth_m = episode.sensor, episode.frames[0].depth_m
        states = depth_states(spec.grid, sensor.camera, sensor.world_T_camera, depth_m)
        out.add(episode.episode_id, np.isin(states, (VoxelState.SURFACE, VoxelState.OCCLUDED)))
