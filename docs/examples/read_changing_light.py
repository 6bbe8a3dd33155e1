"""The room without people in the light of a frame, with numpy and Pillow only. Usage: ... EPISODE_FOLDER FRAME"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image

folder, frame = Path(sys.argv[1]) / "recording", int(sys.argv[2])
table = np.load(folder / "light.npz")
weight, exposure = table["weight"][frame], table["exposure"][frame]  # (K, 3), ()
total = np.zeros((), dtype=np.float32)
for k in np.flatnonzero(weight.any(axis=1)):
    root = np.array(Image.open(folder / f"light_{k}.png")).astype(np.float32) / np.float32(4096)
    red_green_blue = np.stack(np.split(root, 3), axis=-1)
    total = total + red_green_blue * red_green_blue * (exposure * weight[k])
steps = np.minimum(np.sqrt(total) * np.float32(4096), np.float32(65535)).astype(np.uint16)
rgb = table["display"][steps]

print(f"frame {frame}: {len(weight)} lights, exposure {exposure:.2f}, rgb {rgb.shape}, mean {rgb.mean():.0f}")
