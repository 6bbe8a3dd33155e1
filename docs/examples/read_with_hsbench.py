"""Open one episode with hsbench. Usage: read_with_hsbench.py DATA_FOLDER"""

import sys

import hsbench

data = hsbench.load(sys.argv[1], "val", truth=True, until_s=60)
episode = data[0]
frame = episode.frames[-1]  # decoded now: (h, w, 3) uint8, and float32 metres with sensor noise
print(f"{episode.episode_id}: {len(episode.frames)} frames, {len(episode.poses)} poses in {episode.duration_s:.0f} s")
print(f"rgb {frame.rgb.shape}, depth {frame.depth_m.shape}, {(frame.depth_m == 0).mean():.1%} of pixels without depth")
truth = episode.truth
print(f"{truth.occupancy.solid.sum()} solid voxels, {len(truth.scene.objects)} objects, {len(truth.events)} events")
