"""Open an episode with pandas, pyarrow, Pillow and numpy only. Usage: read_without_hsbench.py EPISODE_FOLDER FRAME"""

import json
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
from PIL import Image

folder, frame = Path(sys.argv[1]), int(sys.argv[2])
sensor = json.loads((folder / "episode.json").read_text())["sensor"]
joints_m = np.stack(pd.read_parquet(folder / "inputs/poses.parquet")["joints_m"]).reshape(-1, 25, 3)  # metres
solid = np.load(folder / "truth/occupancy.npz")["semantic"] > 0
objects = pd.read_parquet(folder / "truth/objects.parquet")
frames = pd.read_parquet(folder / "recording/patches.parquet")
rgb, depth_mm = (np.array(Image.open(folder / f"recording/background_{name}.png")) for name in ("rgb", "depth"))
start, size, r, n = frames.loc[frame, ["start", "size", "runs", "pixels"]]  # lay this frame's patch over it
data = pa.decompress((folder / "recording/patches.zst").read_bytes()[start : start + size], 4 * r + 7 * n, "zstd")
runs, ids, colour, low, high = np.split(np.frombuffer(data, np.uint8), np.cumsum([4 * r, 2 * n, 3 * n, n]))
places = np.flatnonzero(np.repeat(np.arange(r) % 2, runs.view("<u4")))  # background, patch, background, patch ...
steps = pd.DataFrame(np.c_[colour.reshape(n, 3), low + 256 * high.astype(int) - 128])
red, green, blue, depth = steps.groupby(places % rgb.shape[1]).cumsum().to_numpy().T  # down each column
rgb.reshape(-1, 3)[places] = np.c_[red + green, green, blue + green] % 256
depth_mm.reshape(-1)[places] = depth % 65536

print(f"camera {sensor['height_m']:.2f} m high, {len(joints_m)} observed poses")
print(f"{len(frames)} frames; at {frames['timestamp_ns'][frame] / 1e9:.1f} s {rgb.shape}, {np.median(depth_mm)} mm")
print(f"{solid.sum()} solid voxels, {len(objects)} objects")
