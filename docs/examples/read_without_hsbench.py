"""Open one episode with pandas, Pillow and numpy only. Usage: read_without_hsbench.py EPISODE_FOLDER"""

import json
import sys
from pathlib import Path

import numpy as np
import pandas as pd
from PIL import Image

folder = Path(sys.argv[1])
sensor = json.loads((folder / "episode.json").read_text())["sensor"]
poses = pd.read_parquet(folder / "inputs/poses.parquet")
joints_m = np.stack(poses["joints_m"]).reshape(len(poses), 25, 3)  # metres, episode frame
frames = pd.read_parquet(folder / "recording/patches.parquet")
rgb = np.array(Image.open(folder / "recording/background_rgb.png"))
depth_mm = np.array(Image.open(folder / "recording/background_depth.png"))
row = frames.iloc[len(frames) // 2]  # put this frame's patch onto the background
size = (row["height"], row["width"])
bits = np.unpackbits(np.frombuffer(row["mask"], np.uint8), bitorder="little")
mask = bits[: size[0] * size[1]].reshape(size).astype(bool)
window = np.s_[row["row"] : row["row"] + size[0], row["column"] : row["column"] + size[1]]
rgb[window][mask] = np.frombuffer(row["rgb"], np.uint8).reshape(-1, 3)
depth_mm[window][mask] = np.frombuffer(row["depth_mm"], "<u2")
solid = np.load(folder / "truth/occupancy.npz")["semantic"] > 0
objects = pd.read_parquet(folder / "truth/objects.parquet")

print(f"camera {sensor['height_m']:.2f} m high, {len(joints_m)} observed poses")
print(f"{len(frames)} frames; at {row['timestamp_ns'] / 1e9:.1f} s {rgb.shape}, {np.median(depth_mm)} mm")
print(f"{solid.sum()} solid voxels, {len(objects)} objects")
