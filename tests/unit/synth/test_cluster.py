"""A real Dask scheduler with two worker processes: the same bytes, also when one of them is killed."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from threading import Thread

import pytest

import hsbench
from hsbench.cli.main import run
from hsbench.errors import DataError, MissingExtraError
from hsbench.io.checksums import manifest
from hsbench.synth.executors import Cluster
from tests.unit.synth.toy_recipe import write_toy

ROOT = Path(hsbench.__file__).parents[1]
START_S = 120.0


def double(task: int) -> int:
    return 2 * task


def _start(words: list[str], log: Path) -> subprocess.Popen[bytes]:
    with log.open("wb") as file:
        return subprocess.Popen(
            [sys.executable, "-m", *words], cwd=ROOT, stdout=file, stderr=file, start_new_session=True
        )


def _wait_for(text: str, log: Path) -> None:
    deadline = time.monotonic() + START_S
    while text not in log.read_text(errors="replace"):
        assert time.monotonic() < deadline, log.read_text(errors="replace")
        time.sleep(0.1)


def _say(server: socket.socket, answer: bytes) -> None:
    with suppress(OSError):  # the server is closed when the test is done
        connection, _ = server.accept()
        with connection:
            connection.sendall(answer)
            while connection.recv(1024):
                pass


@pytest.fixture
def scheduler(tmp_path: Path) -> Iterator[str]:
    """The address of a scheduler without workers."""
    pytest.importorskip("distributed")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    words = ["distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard"]
    process = _start(words, tmp_path / "scheduler.log")
    _wait_for("Scheduler at", tmp_path / "scheduler.log")
    yield f"tcp://127.0.0.1:{port}"
    process.terminate()
    process.wait()


def _worker(scheduler: str, place: Path, threads: int = 1) -> subprocess.Popen[bytes]:
    place.mkdir()
    words = ["distributed.cli.dask_worker", scheduler, "--nthreads", str(threads), "--no-nanny", "--no-dashboard"]
    process = _start([*words, "--local-directory", str(place)], place / "log")
    _wait_for("Registered to", place / "log")
    return process


@pytest.mark.slow
def test_dask_gives_the_same_bytes_and_survives_a_worker(scheduler: str, tmp_path: Path) -> None:
    recipe = write_toy(tmp_path / "recipe", settings="lasts_s = 0.2\n")
    words = ["generate", str(recipe), "--size", "small", "--out"]
    assert run([*words, str(tmp_path / "whole")]) == 0
    workers = [_worker(scheduler, tmp_path / name) for name in ("a", "b")]
    try:
        command = [sys.executable, "-m", "hsbench.cli.main", *words, str(tmp_path / "dask"), "--dask", scheduler]
        process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        deadline = time.monotonic() + START_S
        while len(list(tmp_path.glob("dask/episodes/toy-*"))) < 4:
            assert time.monotonic() < deadline
            time.sleep(0.02)
        os.kill(workers[0].pid, signal.SIGKILL)
        said, errors = process.communicate(timeout=START_S)
        assert process.returncode == 0, errors
        assert "30 scenes (30 episodes made now)" in said
        assert manifest(tmp_path / "dask") == manifest(tmp_path / "whole")
    finally:
        for worker in workers:
            worker.kill()
            worker.wait()


@pytest.mark.slow
def test_a_worker_with_threads_is_refused(scheduler: str, tmp_path: Path) -> None:
    worker = _worker(scheduler, tmp_path / "a", threads=2)
    try:
        with pytest.raises(DataError, match="start it with --nthreads 1"):
            list(Cluster(scheduler).outcomes(double, [1]))
    finally:
        worker.kill()
        worker.wait()


def test_no_scheduler_and_no_package(monkeypatch: pytest.MonkeyPatch) -> None:
    if shutil.which("dask") is not None:
        monkeypatch.setattr("hsbench.synth.executors.CONNECT_S", 0.5)
        with pytest.raises(DataError, match=r"no Dask scheduler answers at tcp://127\.0\.0\.1:9"):
            list(Cluster("tcp://127.0.0.1:9").outcomes(double, [1]))
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'hsbench\[cluster\]'"):
        list(Cluster("tcp://127.0.0.1:9").outcomes(double, [1]))


@pytest.mark.parametrize(
    ("address", "answer"),
    [("nowhere", b""), ("tcp://127.0.0.1:9", b""), ("", b"HTTP/1.1 400 Bad Request\r\n\r\n"), ("", b"")],
)
def test_where_no_scheduler_answers_nothing_is_left(tmp_path: Path, address: str, answer: bytes) -> None:
    """One line, no folder, and no client that goes on looking for the scheduler.

    "": something else takes the call, and answers as a dashboard would, or not at all.
    """
    pytest.importorskip("distributed")
    recipe, out = write_toy(tmp_path / "recipe"), tmp_path / "out"
    code = (
        "import sys, hsbench.synth.executors as e; from hsbench.cli.main import run; e.CONNECT_S = 1; sys.exit(run())"
    )
    words = ["generate", str(recipe), "--frames", "none", "--out", str(out), "--dask"]
    with socket.create_server(("127.0.0.1", 0)) as other:
        address = address or f"tcp://127.0.0.1:{other.getsockname()[1]}"
        Thread(target=_say, args=(other, answer), daemon=True).start()
        command = [sys.executable, "-c", code, *words, address]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=START_S)
    assert done.returncode == 2
    assert done.stderr == f"error: no Dask scheduler answers at {address} (is it tcp://HOST:8786?)\n"
    assert not out.exists()


def test_a_cluster_has_its_own_workers(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recipe = write_toy(tmp_path / "recipe")
    words = ["generate", str(recipe), "--out", str(tmp_path / "o"), "--dask", "tcp://127.0.0.1:9", "--workers", "2"]
    assert run(words) == 2
    assert "leave out --workers" in capsys.readouterr().err
