"""Open one episode with hsbench. Usage: read_with_hsbench.py DATA_FOLDER"""

import sys

import hsbench

data = hsbench.load(sys.argv[1], "val", truth=True, until_s=60)
episode = data[0]
print(f"{episode.episode_id}: {len(episode.poses)} poses in {episode.duration_s:.0f} s")
frame = episode.frames[-1]  # decoded now, with sensor noise
print(f"rgb {frame.rgb.shape}, no depth at {(frame.depth_m == 0).mean():.1%} of pixels")
truth = episode.truth
print(f"{truth.occupancy.solid.sum()} solid voxels, {len(truth.scene.objects)} objects")
