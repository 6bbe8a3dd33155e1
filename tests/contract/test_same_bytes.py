"""The same submission on the same truth gives the same bytes: elsewhere, by other workers, in another order."""

from __future__ import annotations

import multiprocessing
import os
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__

from hsbench import Evaluator, load
from hsbench.cli.main import run
from hsbench.evaluation import DatasetRef, Report, write_report
from hsbench.evaluation.episode_table import write_episode_table
from hsbench.schema import Episode
from hsbench.submission import SubmissionWriter
from hsbench.tasks import TaskSpec, task
from hsbench.viz.report_page import report_page
from tests.contract.test_tasks import RANDOM, boards, metadata

WORKERS = 3
PARTS = (".json", ".parquet", ".html")


def answer(spec: TaskSpec, episode: Episode, observed_s: float = 0.0) -> Any:
    """Any answer, which follows from the episode's name and the time alone."""
    rng = np.random.default_rng([*episode.episode_id.encode(), int(observed_s)])
    return RANDOM[spec.name](rng, spec.dummy(episode))


def earlier(spec: TaskSpec, episode: Episode) -> list[float]:
    """One time apart, for a curve."""
    return [t for t in spec.observation_times_s[:1] if t < episode.duration_s]


def submit(root: Path, spec: TaskSpec, data: Path) -> Path:
    with SubmissionWriter(root / "s", spec, metadata(spec, "poses")) as writer:
        for episode in load(data, frames=False):
            writer.add(episode.episode_id, answer(spec, episode))
            for observed_s in earlier(spec, episode):
                writer.add(episode.episode_id, answer(spec, episode, observed_s), observed_s)
    return root / "s"


def part(name: str, data: Path, ids: Sequence[str]) -> Evaluator:
    """What one worker does."""
    evaluator, episodes = Evaluator(name), load(data, truth=True, frames=False)
    spec = task(name).on(episodes.name)
    for episode in map(episodes.episode, ids):
        evaluator.add(episode, answer(spec, episode), {t: answer(spec, episode, t) for t in earlier(spec, episode)})
    return evaluator


def files_of(report: Path) -> dict[str, bytes]:
    return {suffix: report.with_suffix(suffix).read_bytes() for suffix in PARTS}


def written(path: Path, report: Report) -> dict[str, bytes]:
    """What ``hsbench score`` writes of a report."""
    write_report(path, report)
    write_episode_table(path.with_suffix(".parquet"), report)
    path.with_suffix(".html").write_bytes(report_page(report).encode())
    return files_of(path)


def reversed_zip(folder: Path, archive: Path) -> Path:
    """The files of a folder in the opposite order, stored and not compressed."""
    with zipfile.ZipFile(archive, "w") as made:
        for file in sorted((f for f in folder.rglob("*") if f.is_file()), reverse=True):
            made.write(file, file.relative_to(folder))
    return archive


def another_machine() -> dict[str, str]:
    """An environment in which numpy knows no more than the oldest processor, and hashes, threads and time differ."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("LC_", "COVERAGE"))}
    modern = [name for name in __cpu_dispatch__ if __cpu_features__[name]]
    threads = dict.fromkeys(("OMP_NUM_THREADS", "NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
    machine = {
        "NPY_DISABLE_CPU_FEATURES": " ".join(modern),
        "PYTHONHASHSEED": "4711",
        "TZ": "Asia/Tokyo",
        "LC_ALL": "C",
    }
    return kept | threads | machine


@boards
def test_bytes_of_a_report(
    spec: TaskSpec, dataset: str, data_of: Callable[[str], Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data, spec = data_of(dataset), spec.on(dataset)
    submission = submit(tmp_path, spec, data)
    on_data = ["--task", spec.name, "--out"]
    assert run(["score", str(submission), *on_data, str(tmp_path / "here.json"), "--data", str(data)]) == 0
    expected = files_of(tmp_path / "here.json")

    moved = Path(shutil.copytree(data, tmp_path / "moved"))
    archive = reversed_zip(submission, tmp_path / "reversed.zip")
    there = tmp_path / "there.json"
    words = [sys.executable, "-m", "hsbench.cli.main", "score", archive, *on_data, there, "--data", moved]
    subprocess.run(list(map(str, words)), env=another_machine(), cwd=tmp_path, check=True, capture_output=True)
    assert files_of(there) == expected

    episodes = load(data, frames=False)
    ids = np.random.default_rng(1).permutation(episodes.episode_ids).tolist()
    workers = [part(spec.name, data, ids[k::WORKERS]) for k in range(min(WORKERS, len(ids)))]
    for worker in workers[1:]:
        worker.merge(workers[0])
        workers[0] = worker
    description = episodes.description
    where = DatasetRef(description["name"], description["splits_version"], episodes.manifest_sha256)
    splits = {row["split"] for row in episodes.rows}
    split = splits.pop() if len(splits) == 1 else "all"
    assert written(tmp_path / "merged.json", workers[0].report(where, split, metadata(spec, "poses"))) == expected


@pytest.mark.slow
def test_parts_of_other_processes_merge(rgbd: Path, tmp_path: Path) -> None:
    name, ids = "object-detection-3d", list(load(rgbd).episode_ids)
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as pool:
        halves = list(pool.map(part, [name] * 2, [rgbd] * 2, [ids[::2], ids[1::2]]))
    halves[0].merge(halves[1])
    assert halves[0].metrics() == part(name, rgbd, ids).metrics()
