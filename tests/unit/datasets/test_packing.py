"""Packing: tracks and names say nothing, what is unsafe or damaged is refused in a line, nothing is half there."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from episode_builders import SENSORS, poses, same, true_poses
from hypothesis import given
from hypothesis import strategies as st

from hsbench import load
from hsbench.cli.main import run
from hsbench.datasets.faults import dataset_faults
from hsbench.datasets.importers.capture_set import add_capture
from hsbench.datasets.packing import _Hidden, pack_inputs, pack_truth
from hsbench.errors import DataError
from hsbench.io.atomic import write_json
from hsbench.io.dataset_index import write_index
from hsbench.io.image_frames import FileFrames
from hsbench.io.strict_json import read_json
from hsbench.schema import Episode, EpisodeTruth, PoseTable

SECRET = 0xC0FFEE << 104
OLD = Path(__file__).parents[2] / "fixtures" / "schema-0.2"


@pytest.fixture
def captures(tmp_path: Path) -> Path:
    """Two imports: photographs that say when they were made beside an estimated background, and poses with truth."""
    root, pictures = tmp_path / "captures", []
    for k in range(2):
        path = tmp_path / f"{k}.jpg"
        picture = np.random.default_rng(k).integers(0, 256, (18, 24, 3), dtype=np.uint8)
        path.write_bytes(with_comment(cv2.imencode(".jpg", picture)[1].tobytes(), b"taken at home"))
        pictures.append(path)
    stamps = np.array([0, 10**8], dtype=np.int64)
    background = np.zeros((18, 24, 3), dtype=np.uint8)
    frames = FileFrames(stamps, tuple(pictures), (None, None), background)
    add_capture(root, Episode("home", "mine", SENSORS["monocular"], frames, None, 0, 10**9))
    truth = EpisodeTruth(poses=replace(true_poses(), match=np.full(6, -1, dtype=np.int64)))
    nothing = FileFrames(np.empty(0, dtype=np.int64), (), ())
    add_capture(root, Episode("attic", "mine", SENSORS["rgbd"], nothing, poses(), 0, 10**9, truth=truth))
    return root


def with_comment(jpeg: bytes, comment: bytes) -> bytes:
    return jpeg[:2] + b"\xff\xfe" + (len(comment) + 2).to_bytes(2, "big") + comment + jpeg[2:]


def pack(data: Path, out: Path, secret: int | None = SECRET) -> tuple[Path, Path]:
    for part, write in (("inputs", pack_inputs), ("truth", pack_truth)):
        list(write(data, out / part, secret))
    return out / "inputs", out / "truth"


def test_photographs_lose_everything_but_their_pixels(captures: Path, tmp_path: Path) -> None:
    inputs, truth = pack(captures, tmp_path)
    assert load(inputs).episode_ids == load(truth).episode_ids == ("mine-hidden-000000", "mine-hidden-000001")
    before = load(captures).episode("home")
    assert before.frames.background is not None
    (after,) = (e for e in load(inputs) if len(e.frames))
    assert after.frames.background is None
    for k in range(2):
        assert np.array_equal(after.frames[k].rgb, before.frames[k].rgb)
    files = [p for p in inputs.rglob("*") if p.is_file()]
    assert {p.suffix for p in files} == {".json", ".parquet", ".png"}
    assert not any(word in p.read_bytes() for p in files for word in (b"taken at home", b"attic"))


def test_truth_is_with_the_truth_alone(captures: Path, tmp_path: Path) -> None:
    inputs, truth = pack(captures, tmp_path)
    known = load(captures, truth=True).episode("attic").truth.poses
    (found,) = (e.truth.poses for e in load(truth, truth=True) if e.truth.poses is not None)
    assert same(found.poses, known.poses)
    assert np.array_equal(found.action, known.action)
    for episode in load(inputs, truth=True):
        assert all(value is None for value in vars(episode.truth).values())


def test_the_secret_decides_names_and_order_and_is_the_same_for_both_parts(captures: Path, tmp_path: Path) -> None:
    """With another secret other names: of eight, some give the one order of two episodes and some the other."""
    orders = set()
    for k in range(8):
        inputs, truth = pack(captures, tmp_path / str(k), SECRET + k)
        sizes = [[len(e.frames) for e in load(root)] for root in (inputs, truth)]
        assert sizes[0] == sizes[1]
        orders.add(tuple(sizes[0]))
    assert orders == {(2, 0), (0, 2)}


def test_the_same_call_gives_the_same_bytes(captures: Path, tmp_path: Path) -> None:
    first, second = (pack(captures, tmp_path / name) for name in ("a", "b"))
    for one, other in zip(first, second, strict=True):
        names = [p.relative_to(one) for p in sorted(one.rglob("*"))]
        assert names == [p.relative_to(other) for p in sorted(other.rglob("*"))]
        assert all((one / n).is_dir() or (one / n).read_bytes() == (other / n).read_bytes() for n in names)


def test_data_of_an_older_schema(tmp_path: Path) -> None:
    """Inputs are written anew, truth stays as it is: both are sound, and agree."""
    old = Path(shutil.copytree(OLD, tmp_path / "old"))
    for unit in ("film-1",):  # its depth is without noise
        shutil.rmtree(old / "episodes" / unit)
    write_index(old)
    inputs, truth = pack(old, tmp_path / "packed")
    for root in (inputs, truth):
        assert [fault.text for found in dataset_faults(root) for fault in found] == []
    for a, b in zip(load(inputs), load(truth), strict=True):
        assert same(a.poses, b.poses)
        assert a.sensor == b.sensor


# ---------------------------------------------------------------- tracks


def hidden(secret: int) -> _Hidden:
    return _Hidden(secret, {}, {})


@st.composite
def observed(draw: st.DrawFn) -> PoseTable:
    """Tracks with any ids that begin at any of four times."""
    ids = draw(st.lists(st.integers(-5, 2**31 - 1), min_size=1, max_size=5, unique=True))
    rows = sorted({(t, i) for i in ids for t in draw(st.sets(st.integers(0, 3), min_size=1))})
    state = np.full((len(rows), 25), 2, dtype=np.uint8)
    joints = np.arange(len(rows) * 75, dtype=np.float32).reshape(len(rows), 25, 3) / 75
    time, track = np.array(rows, dtype=np.int64).T
    return PoseTable("kinect-v2-25", time, track.astype(np.int32), state, joints)


@given(observed(), st.integers(0, 9))
def test_tracks_are_numbered_as_they_begin(table: PoseTable, secret: int) -> None:
    order, found = hidden(secret).tracks("e", table)
    assert same(found.joints_m, table.joints_m[order])
    assert np.array_equal(found.timestamp_ns, table.timestamp_ns)
    pairs = set(zip(table.track_id[order].tolist(), found.track_id.tolist(), strict=True))
    assert len(pairs) == len({a for a, _ in pairs}) == len({b for _, b in pairs})  # one to one
    assert sorted({b for _, b in pairs}) == list(range(1, len(pairs) + 1))
    begins = [int(found.timestamp_ns[found.track_id == k].min()) for k in range(1, len(pairs) + 1)]
    assert begins == sorted(begins)


def test_of_tracks_that_begin_together_none_is_first_by_its_old_number() -> None:
    """A detector that numbers false detections before people would else tell which is which."""
    first = np.zeros(2, dtype=np.int64)
    table = PoseTable(
        "kinect-v2-25",
        first,
        np.array([1, 2], np.int32),
        np.full((2, 25), 2, np.uint8),
        np.zeros((2, 25, 3), np.float32),
    )
    swapped = sum(hidden(secret).tracks("e", table)[0].tolist() == [1, 0] for secret in range(1000))
    assert 450 < swapped < 550  # three standard deviations about a half


# ---------------------------------------------------------------- what is refused


def refused(data: Path, tmp_path: Path, message: str, secret: int | None = SECRET) -> None:
    for write in (pack_inputs, pack_truth):
        with pytest.raises(DataError, match=message) as error:
            list(write(data, tmp_path / "out", secret))
        assert "\n" not in str(error.value)
        assert not [p for p in tmp_path.iterdir() if "out" in p.name]


def test_secrets_that_can_be_guessed(captures: Path, tmp_path: Path) -> None:
    refused(captures, tmp_path, r"has no seed \(an import\?\); expected --secret N", None)
    refused(captures, tmp_path, "secret 7 of a hidden split can be guessed; expected 128 random bits", 7)
    write_json(captures / "dataset.json", {**read_json(captures / "dataset.json"), "seed": 0})
    write_index(captures)
    refused(captures, tmp_path, "seed 0 of a hidden split can be guessed")  # a good secret does not mend it


def test_damaged_data(captures: Path, tmp_path: Path) -> None:
    (captures / "episodes" / "attic" / "truth" / "match.parquet").write_bytes(b"PAR1")
    refused(captures, tmp_path, r"match\.parquet has changed since it was made; a split packed from it")


def test_depth_without_noise(tmp_path: Path) -> None:
    old = Path(shutil.copytree(OLD, tmp_path / "old"))
    with pytest.raises(DataError, match="episode film-1 has depth without noise; expected noise that hides"):
        list(pack_inputs(old, tmp_path / "inputs", SECRET))
    assert not (tmp_path / "inputs").exists()


def test_places_that_are_taken(captures: Path, tmp_path: Path) -> None:
    (tmp_path / "taken").mkdir()
    for write in (pack_inputs, pack_truth):
        with pytest.raises(DataError, match="taken exists already"):
            list(write(captures, tmp_path / "taken", SECRET))
        with pytest.raises(DataError, match="lies inside of the data set"):
            list(write(captures, captures / "packed", SECRET))


# ---------------------------------------------------------------- the command


def test_the_command(captures: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["--secret", str(SECRET)]
    assert run(["pack", "inputs", str(captures), "--out", str(tmp_path / "i"), *words]) == 0
    told = capsys.readouterr().out
    assert told == f"{tmp_path / 'i'}: 2 episodes\nnext: hsbench pack truth {captures} --out DIR --secret N\n"
    assert run(["pack", "truth", str(captures), "--out", str(tmp_path / "t"), *words]) == 0
    told = capsys.readouterr().out
    assert told.endswith(f"next: hsbench score SUBMISSION --task NAME --data {tmp_path / 't'} --out report.json\n")
    assert run(["verify", str(tmp_path / "i")]) == run(["verify", str(tmp_path / "t")]) == 0
    capsys.readouterr()
    assert run(["pack", "inputs", str(captures), "--out", str(tmp_path / "i"), *words]) == 2
    assert run(["pack", "inputs", str(captures), "--out", str(tmp_path / "j")]) == 2
    faults = capsys.readouterr().err.splitlines()
    assert [line.startswith("error: ") for line in faults] == [True, True]
