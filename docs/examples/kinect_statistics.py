"""Recordings of a real Kinect v2 beside generated observed poses: bones, speeds, tracking states.

Usage: kinect_statistics.py DATA RECORDING...

DATA is a data set of recipe rgbd-activity. A RECORDING is a CSV file of 25 joints (x, y, z, state, with or without a
time stamp of 100 ns first; without, 30 Hz are assumed) or an NTU RGB+D ``.skeleton`` file (30 Hz). For every figure the
least, median and greatest of the recordings' own medians are printed, and the same over episodes of DATA.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import hsbench
from hsbench.schema import KINECT_V2

Take = tuple[np.ndarray, np.ndarray, np.ndarray]  # times (T,) s, joints (T, 25, 3) m, states (T, 25)

J = {name: k for k, name in enumerate(KINECT_V2.names)}
BONES = {
    "torso": ("spine_base", "spine_shoulder"), "neck to head": ("neck", "head"),
    "shoulders": ("shoulder_left", "shoulder_right"), "hips": ("hip_left", "hip_right"),
    **{f"{name}, {side}": (f"{a}_{side}", f"{b}_{side}") for name, a, b in (
        ("upper arm", "shoulder", "elbow"), ("forearm", "elbow", "wrist"),
        ("thigh", "hip", "knee"), ("shank", "knee", "ankle")) for side in ("left", "right")},
}  # fmt: skip
MOVING = ("head", "spine_base", "hand_left", "hand_right", "ankle_left", "ankle_right")
KINECT_HZ = 30.0
GAP_S = 0.1  # speeds are taken between frames not farther apart
NUMBERS = {100: False, 101: True}  # values a line of CSV -> whether a time comes first


def read(path: Path) -> list[Take]:
    """The people of a recording, one take each."""
    return read_ntu(path) if path.suffix == ".skeleton" else [read_csv(path)]


def read_csv(path: Path) -> Take:
    """A CSV recording of one person."""
    lines = [line.strip().strip(",") for line in path.read_text(encoding="utf-8").splitlines()]
    rows = np.array([[float(v) for v in line.split(",")] for line in lines if line])
    if rows.shape[1] not in NUMBERS:
        raise SystemExit(f"{path}: {rows.shape[1]} values a line; expected 25 x (x, y, z, state), perhaps a time first")
    timed = NUMBERS[rows.shape[1]]
    values = rows[:, int(timed) :].reshape(len(rows), 25, 4)
    times = (rows[:, 0] - rows[0, 0]) * 1e-7 if timed else np.arange(len(rows)) / KINECT_HZ
    return times, values[..., :3], values[..., 3].astype(int)


def read_ntu(path: Path) -> list[Take]:
    """An NTU RGB+D skeleton file: frames, in each bodies, of each 25 joints of 12 numbers, the last the state."""
    words = iter(path.read_text(encoding="utf-8").splitlines())
    people: dict[str, list[tuple[float, np.ndarray]]] = {}
    for frame in range(int(next(words))):
        for _ in range(int(next(words))):
            name = next(words).split()[0]
            joints = np.array([[float(v) for v in next(words).split()] for _ in range(int(next(words)))])
            people.setdefault(name, []).append((frame / KINECT_HZ, joints))
    return [
        (np.array([t for t, _ in rows]), np.stack([j[:, :3] for _, j in rows]), np.stack([j[:, 11] for _, j in rows]))
        for rows in people.values()
    ]


def generated(data: str) -> list[Take]:
    """The longest observed track of each episode."""
    takes = []
    for episode in hsbench.load(data):
        poses = episode.poses
        if poses is None or poses.joints_m is None or not len(poses):
            continue
        rows = poses.track_id == np.bincount(poses.track_id).argmax()
        takes.append((poses.timestamp_ns[rows] / 1e9, poses.joints_m[rows].astype(float), poses.joint_state[rows]))
    return takes


def statistics(take: Take) -> dict[str, float]:
    """One figure a name."""
    times, joints, states = take
    found: dict[str, float] = {}
    for name, (a, b) in BONES.items():
        both = (states[:, [J[a], J[b]]] == 2).all(axis=1)
        length = np.linalg.norm(joints[both, J[a]] - joints[both, J[b]], axis=1)
        found[f"bone {name} [cm]"] = 100 * float(np.median(length)) if len(length) else np.nan
        found[f"spread of {name} [%]"] = 100 * float(length.std() / np.median(length)) if len(length) else np.nan
    near = np.diff(times) < GAP_S
    for name in MOVING:
        both = near & (states[1:, J[name]] == 2) & (states[:-1, J[name]] == 2)
        speed = np.linalg.norm(np.diff(joints[:, J[name]], axis=0)[both], axis=1) / np.diff(times)[both]
        for title, q in (("median", 50), ("95 %", 95)):
            found[f"speed {name}, {title} [m/s]"] = float(np.percentile(speed, q)) if len(speed) else np.nan
    for state, title in ((2, "tracked"), (1, "inferred"), (0, "not tracked")):
        found[f"{title} joints [%]"] = 100 * float((states == state).mean())
    return found


def main(data: str, recordings: list[Path]) -> None:
    """Print the table; a last column says whether the ranges meet."""
    real = [statistics(take) for path in recordings for take in read(path)]
    ours = [statistics(take) for take in generated(data)]
    print(f"{len(real)} real takes, {len(ours)} generated ones")
    print(f"{'':34s} {'real: least median greatest':>30s} {'generated':>30s}")
    for name in real[0]:
        a, b = (np.array([take[name] for take in takes]) for takes in (real, ours))
        apart = np.nanmin(a) > np.nanmax(b) or np.nanmin(b) > np.nanmax(a)
        print(f"{name:34s} {row(a)} {row(b)} {'  apart' if apart else ''}")


def row(values: np.ndarray) -> str:
    """Least, median and greatest."""
    return "".join(f"{v:10.2f}" for v in (np.nanmin(values), np.nanmedian(values), np.nanmax(values)))


if __name__ == "__main__":
    main(sys.argv[1], [Path(p) for p in sys.argv[2:]])
