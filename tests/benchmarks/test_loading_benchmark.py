"""Reading recordings: against cv2.imread of the same frames as PNG, as tensors, and as a large index.

The room and its people are those of the benchmark of sensors: two people, so far away that they cover a given share of
the picture. Sixty pictures are repeated to make a recording of two minutes.
"""

from __future__ import annotations

import resource
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import torch
from torch.utils.data import DataLoader

from hsbench import __version__, load
from hsbench.io.atomic import write_json
from hsbench.io.dataset_index import write_index
from hsbench.io.episodes import read_episode, write_episode
from hsbench.io.frame_store import Film, Recording, write_recording
from hsbench.io.images import write_png
from hsbench.schema import SCHEMA_VERSION, Episode, EpisodeTruth
from hsbench.schema.scene import PERSON_ID_OFFSET
from hsbench.synth.assemble import film
from hsbench.synth.render import open_renderer
from hsbench.torch import FrameDataset, Sometimes, collate, mirrored
from tests.benchmarks.ratios import best_s, report
from tests.benchmarks.test_sensors_benchmark import OURS_FRAMES, RGBD, shot

pytestmark = pytest.mark.slow

FRAMES = 3600  # two minutes at 30 Hz
PERIOD_NS = 10**9 // 30
KINDS = ("rgb", "depth_mm", "instance")
INDEXED = 10_000


@dataclass(frozen=True)
class Recorded:
    """The same sixty frames as a recording and as PNGs; share: of the pictures, that people cover."""

    store: Path
    pngs: Path
    film: Film
    share: float


def recorded(folder: Path, distance_m: float) -> Recorded:
    of = shot(RGBD, distance_m)
    made = film(of.filming(open_renderer("raycast")), np.arange(OURS_FRAMES), 0, "none")
    store, pngs = folder / "store", folder / "pngs"
    store.mkdir(parents=True)
    pngs.mkdir()
    patches = [made.patch(k) for k in range(OURS_FRAMES)]
    write_recording(store, made.background, patches)
    made, shares = replace(made, patch=patches.__getitem__), []
    for k in range(OURS_FRAMES):
        picture = made.picture(k)
        shares.append((picture.instance > PERSON_ID_OFFSET).mean())
        for kind in KINDS:
            write_png(pngs / f"{k:06d}_{kind}.png", getattr(picture, kind))
    return Recorded(store, pngs, made, float(np.mean(shares)))


@pytest.fixture(scope="module")
def far(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    return recorded(tmp_path_factory.mktemp("far"), 4.0)


@pytest.fixture(scope="module")
def dataset(far: Recorded, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data set of one episode of 3600 frames with depth noise of a Kinect on reading."""
    root = tmp_path_factory.mktemp("data")
    (root / "episodes").mkdir()

    def patch(index: int) -> Any:
        return replace(far.film.patch(index % OURS_FRAMES), timestamp_ns=index * PERIOD_NS)

    stamps = np.arange(FRAMES, dtype=np.int64) * PERIOD_NS
    frames = replace(far.film, timestamps_ns=stamps, patch=patch, noise_preset="kinect")
    episode = Episode("loading-000000", "loading", RGBD, frames, None, 0, int(stamps[-1]), truth=EpisodeTruth())
    write_episode(root / "episodes" / episode.episode_id, episode, "scene-000000", "train")
    write_json(root / "dataset.json", described("loading"))
    write_index(root)
    return root


def described(name: str) -> dict[str, str]:
    return {"schema_version": SCHEMA_VERSION, "hsbench_version": __version__, "name": name, "licence": "CC-BY-4.0"}


@pytest.mark.parametrize("distance_m", [5.0, 3.5, 2.2, 1.5])
def test_random_reading_and_size(benchmark: Any, tmp_path: Path, distance_m: float) -> None:
    both = recorded(tmp_path, distance_m)
    order = np.random.default_rng(0).permutation(OURS_FRAMES).tolist()
    recording = Recording(both.store)

    def ours() -> None:
        for k in order:
            recording.picture(k)

    def theirs() -> None:
        for k in order:
            for kind in KINDS:
                cv2.imread(str(both.pngs / f"{k:06d}_{kind}.png"), cv2.IMREAD_UNCHANGED)

    benchmark.pedantic(ours, rounds=1)
    label = f"random reading, people cover {both.share:.1%}"
    wall_s, processor_s = timed(theirs, ours)
    report(label, "cv2.imread of PNGs", *wall_s, 10.0)
    report(f"{label}, processor time", "cv2.imread of PNGs", *processor_s)
    ours_mb, theirs_mb = (sum(f.stat().st_size for f in folder.iterdir()) / 1e6 for folder in (both.store, both.pngs))
    print(f"on disk: {theirs_mb / ours_mb:.1f} times smaller ({theirs_mb:.1f} MB, ours {ours_mb:.1f} MB, goal 10)")
    for k in order[:8]:
        picture = recording.picture(k)
        assert np.array_equal(picture.rgb, cv2.imread(str(both.pngs / f"{k:06d}_rgb.png"))[..., ::-1])
        for kind in KINDS[1:]:
            png = cv2.imread(str(both.pngs / f"{k:06d}_{kind}.png"), cv2.IMREAD_UNCHANGED)
            assert np.array_equal(getattr(picture, kind), png)


def timed(theirs: Callable[[], None], ours: Callable[[], None]) -> tuple[tuple[float, float], tuple[float, float]]:
    """Seconds a frame, (theirs, ours), on the wall and of processor time, which says more where others work too."""
    wall, processor = (
        (best_s(theirs, 5, clock) / OURS_FRAMES, best_s(ours, 5, clock) / OURS_FRAMES)
        for clock in (time.perf_counter, time.process_time)
    )
    return wall, processor


def test_tensors_a_second(benchmark: Any, dataset: Path) -> None:
    order = np.random.default_rng(0).permutation(FRAMES)[:600].tolist()
    torch.set_num_threads(1)

    def pass_over(noise: str | None) -> Callable[[], None]:
        frames = FrameDataset(load(dataset, depth_noise=noise))
        frames[0]

        def run() -> None:
            for k in order:
                frames[k]

        return run

    clean, noisy = pass_over("none"), pass_over(None)
    benchmark.pedantic(clean, rounds=1)
    for clock, label in ((time.perf_counter, ""), (time.process_time, " of processor time")):
        rates = [len(order) / best_s(run, 3, clock) for run in (clean, noisy)]
        print(f"\nrgb and clean depth as tensors, at random: {rates[0]:.0f} frames/s{label} (goal 500)")
        print(f"with the depth noise of a Kinect: {rates[1]:.0f} frames/s{label} (goal 100)")


@pytest.mark.parametrize(("noise", "label"), [("none", "clean"), ("kinect", "with depth noise")])
def test_workers(benchmark: Any, dataset: Path, noise: str, label: str) -> None:
    """The rows of docs/torch.md: on the wall, so on a machine that does nothing else."""
    frames = FrameDataset(load(dataset, depth_noise=noise), every=6, transform=Sometimes(mirrored))

    def rate(workers: int) -> float:
        loader = DataLoader(
            frames, 8, shuffle=True, collate_fn=collate, num_workers=workers, persistent_workers=workers > 0
        )

        def pass_over() -> None:
            for _ in loader:
                pass

        pass_over()  # processes start, code is loaded
        return len(frames) / best_s(pass_over, 2)

    rates = benchmark.pedantic(lambda: [rate(workers) for workers in (0, 1, 2)], rounds=1)
    print(f"\n| batches of 8, mirrored, {label} | {' | '.join(f'{r:.0f}' for r in rates)} |  (0, 1, 2 workers)")
    print(f"two workers over one: {rates[2] / rates[1]:.2f}x (goal 1.6)")


def test_opening_and_memory(benchmark: Any, dataset: Path) -> None:
    folder = dataset / "episodes" / "loading-000000"
    read_episode(folder)

    def opened() -> None:
        assert len(read_episode(folder).frames.timestamps_ns) == FRAMES

    benchmark.pedantic(opened, rounds=1)
    print(f"\nan episode of {FRAMES} frames opens in {best_s(opened, 5) * 1e3:.1f} ms (goal 100)")
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for frame in read_episode(folder, depth_noise="none").frames:
        assert frame.rgb is not None
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    print(f"a pass over it adds {grown:.0f} MB to the most memory that this process took (goal 300)")


def test_opening_a_large_index(benchmark: Any, tmp_path: Path) -> None:
    (tmp_path / "episodes").mkdir()
    row = {"scene_id": "s", "split": "train", "duration_s": 1.0, "n_frames": 1, "n_poses": 0, "renderer": None}
    for k in range(INDEXED):
        unit = tmp_path / "episodes" / f"e-{k:06d}"
        unit.mkdir()
        write_json(unit / "index.json", {"episode_id": unit.name, **row})
        write_json(unit / "manifest.json", {})
    write_json(tmp_path / "dataset.json", described("many"))
    write_index(tmp_path)

    def opened() -> None:
        assert len(load(tmp_path)) == INDEXED

    benchmark.pedantic(opened, rounds=1)
    print(f"\nan index of {INDEXED} episodes opens in {best_s(opened, 3) * 1e3:.0f} ms (goal 2000)")
