"""Slow, plain scorer of scene completion, written from the task text and the file formats alone.

It shares no code with the package. Numpy only opens arrays; every decision is a Python loop over voxels.
"""

import json
import math
import struct
import zlib
from pathlib import Path

import numpy as np

UNKNOWN, FREE, SURFACE, OCCLUDED, MISSING_DEPTH, OUTSIDE_FOV, OUTSIDE_ROOM = range(7)
STRUCTURE = ("floor", "wall", "ceiling", "door", "window")
TOP_M = 2.0
NAMES = ("occluded", "surface+occluded", "occluded-full-height", "occluded-with-structure", "outside-frustum")
NAMES += ("occluded-swept", "occluded-unswept", "known", "everything")


def _json(path):
    return json.loads(Path(path).read_text(encoding="utf-8"))


def masks_of(state, is_structure, centre_z_m, swept):
    """Names of the masks that hold a voxel which is neither ignored nor outside the room."""
    low, names = 0 < centre_z_m <= TOP_M, []
    if state == OCCLUDED and not is_structure:
        names.append("occluded-full-height")
    if state == OCCLUDED and low:
        names.append("occluded-with-structure")
    if state == OCCLUDED and low and not is_structure:
        names += ["occluded", "occluded-swept" if swept else "occluded-unswept"]
    if state in (SURFACE, OCCLUDED) and low and not is_structure:
        names.append("surface+occluded")
    if state != UNKNOWN:
        names.append("everything")
    if state != UNKNOWN and low and not is_structure:
        names.append("known")
    if state == OUTSIDE_FOV and low and not is_structure:
        names.append("outside-frustum")
    return names


def score_episode(episode_folder: Path, occupied) -> dict[str, tuple[int, int, int, int]]:
    """Counts (tp, fp, fn, tn) for each mask, voxel by voxel."""
    truth = Path(episode_folder) / "truth"
    grid = _json(truth / "occupancy.json")
    structure_ids = {o["object_id"] for o in _json(truth / "scene.json")["objects"] if o["category"] in STRUCTURE}
    with np.load(truth / "occupancy.npz", allow_pickle=False) as arrays:
        names = ("semantic", "instance", "state", "ignored_bits", "swept_s")
        semantic, instance, state, ignored_bits, swept_s = (arrays[name].tolist() for name in names)
    nx, ny, nz = grid["shape"]
    predicted = np.asarray(occupied)
    if predicted.shape != (nx, ny, nz) or predicted.dtype != bool:
        raise ValueError(f"prediction is {predicted.dtype} {predicted.shape}, expected bool {(nx, ny, nz)}")
    predicted = predicted.tolist()
    counts = {name: [0, 0, 0, 0] for name in NAMES}
    place = {(True, True): 0, (True, False): 1, (False, True): 2, (False, False): 3}  # predicted, solid
    for i in range(nx):
        for j in range(ny):
            for k in range(nz):
                if (ignored_bits[i][j][k // 8] >> (k % 8)) & 1 or state[i][j][k] == OUTSIDE_ROOM:
                    continue
                solid = semantic[i][j][k] != 0
                is_structure = solid and instance[i][j][k] in structure_ids
                centre_z_m = grid["origin_m"][2] + (k + 0.5) * grid["voxel_m"]
                swept = math.isfinite(swept_s[i][j][k])
                cell = place[predicted[i][j][k], solid]
                for name in masks_of(state[i][j][k], is_structure, centre_z_m, swept):
                    counts[name][cell] += 1
    return {name: tuple(four) for name, four in counts.items()}


def ratios(counts) -> dict[str, float | None]:
    """Of (tp, fp, fn, tn); None without a denominator."""
    tp, fp, fn, _ = counts
    return {
        "iou": tp / (tp + fp + fn) if tp + fp + fn else None,
        "precision": tp / (tp + fp) if tp + fp else None,
        "recall": tp / (tp + fn) if tp + fn else None,
    }


def pooled_iou(rows) -> float | None:
    """Primary number: counts of `occluded` summed over episodes first. A row is what score_episode gives."""
    tp = fp = fn = 0
    for row in rows:
        tp, fp, fn = tp + row["occluded"][0], fp + row["occluded"][1], fn + row["occluded"][2]
    return tp / (tp + fp + fn) if tp + fp + fn else None


def read_png16(path):
    """Rows of a one-channel 16-bit PNG without interlace, as lists of whole numbers."""
    data = Path(path).read_bytes()
    at, body = 8, b""
    while at < len(data):
        (size,) = struct.unpack(">I", data[at : at + 4])
        kind, chunk = data[at + 4 : at + 8], data[at + 8 : at + 8 + size]
        if kind == b"IHDR":
            width, height, depth, colour, _, _, interlace = struct.unpack(">IIBBBBB", chunk)
            if (depth, colour, interlace) != (16, 0, 0):
                raise ValueError(f"{path}: expected one channel of 16 bits, not interlaced")
        elif kind == b"IDAT":
            body += chunk
        at += size + 12
    raw, stride, rows = zlib.decompress(body), 2 * width, []
    above = bytearray(stride)
    for r in range(height):
        method = raw[r * (stride + 1)]
        line = bytearray(raw[r * (stride + 1) + 1 : (r + 1) * (stride + 1)])
        for x in range(stride):
            a, c = (line[x - 2], above[x - 2]) if x >= 2 else (0, 0)
            b = above[x]
            near = sorted(((abs(b - c), 0, a), (abs(a - c), 1, b), (abs(a + b - 2 * c), 2, c)))[0][2]
            line[x] = (line[x] + (0, a, b, (a + b) // 2, near)[method]) % 256
        rows.append([256 * line[2 * x] + line[2 * x + 1] for x in range(width)])
        above = line
    return rows


def in_polygon(x, y, corners):
    """Even-odd rule."""
    inside = False
    for (x0, y0), (x1, y1) in zip(corners, corners[1:] + corners[:1], strict=True):
        if (y0 > y) != (y1 > y) and x < x0 + (y - y0) * (x1 - x0) / (y1 - y0):
            inside = not inside
    return inside


def states_at_t0(episode_folder) -> list:
    """(i, j, k, state) of every fourth voxel along each axis, from the stored clean depth; none outside the room."""
    folder = Path(episode_folder)
    grid, scene = _json(folder / "truth/occupancy.json"), _json(folder / "truth/scene.json")
    sensor = _json(folder / "episode.json")["sensor"]
    camera, depth_mm = sensor["camera"], read_png16(folder / "recording/background_depth.png")
    if camera["model"] != "pinhole" or sensor["roll_rad"] != 0:
        raise ValueError("only a pinhole camera without roll")
    cos_t, sin_t = math.cos(sensor["tilt_rad"]), math.sin(sensor["tilt_rad"])
    margin_m = math.sqrt(3) / 2 * grid["voxel_m"]
    answer = []
    for i in range(0, grid["shape"][0], 4):
        for j in range(0, grid["shape"][1], 4):
            for k in range(0, grid["shape"][2], 4):
                x, y, z = (o + (n + 0.5) * grid["voxel_m"] for o, n in zip(grid["origin_m"], (i, j, k), strict=True))
                if not (in_polygon(x, y, scene["rooms"][0]["outline_xy"]) and 0 <= z <= scene["height_m"]):
                    continue
                up = z - sensor["height_m"]  # camera: right is -y, forward is x turned down by the tilt
                forward, down = x * cos_t - up * sin_t, -x * sin_t - up * cos_t
                state = OUTSIDE_FOV
                if forward > 0:
                    column = math.floor(camera["cx_px"] - camera["fx_px"] * y / forward)
                    row = math.floor(camera["cy_px"] + camera["fy_px"] * down / forward)
                    if 0 <= column < camera["width_px"] and 0 <= row < camera["height_px"]:
                        seen_m = depth_mm[row][column] / 1000
                        if seen_m == 0:
                            state = MISSING_DEPTH
                        elif forward > seen_m + margin_m:
                            state = OCCLUDED
                        else:
                            state = SURFACE if abs(forward - seen_m) <= margin_m else FREE
                answer.append((i, j, k, state))
    return answer
