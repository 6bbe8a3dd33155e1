"""The reader of KIMORE's CSV against recordings of a known person that an independent encoder writes here."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from hsbench.cli.main import run
from hsbench.datasets.dataset import load
from hsbench.datasets.importers import kimore_csv
from hsbench.datasets.importers.kimore_csv import read_kimore_csv
from hsbench.datasets.verify import verify_episode, verify_files
from hsbench.typing import AnyArray
from tests.unit.datasets.mutations import mutated, refused, refused_or_read
from tests.unit.datasets.test_kinect_csv import as_sdk, in_episode

ANY_FILE = settings(deadline=None, max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])


def line(joints: AnyArray, state: AnyArray | int = 2) -> str:
    states = np.broadcast_to(state, 25)
    return "".join(f"{x!r},{y!r},{z!r},{s}," for (x, y, z), s in zip(joints.tolist(), states, strict=True))


def standing(frames: int) -> list[str]:
    return [line(as_sdk(in_episode(2.7), 1.1, 0.1))] * frames


def write(path: Path, lines: list[str], blank: int = 20) -> Path:
    path.write_text("\n" * blank + "\n".join(lines) + "\n", encoding="ascii")
    return path


@ANY_FILE
@given(data=st.data(), frames=st.integers(1, 4), blank=st.integers(0, 30))
def test_round_trip(tmp_path: Path, data: st.DataObject, frames: int, blank: int) -> None:
    joints = data.draw(hnp.arrays(np.float64, (frames, 25, 3), elements=st.floats(-10, 10)))
    state = data.draw(hnp.arrays(np.uint8, (frames, 25), elements=st.integers(0, 2)))
    lines = [line(j, s) for j, s in zip(joints, state, strict=True)]
    bodies = read_kimore_csv(write(tmp_path / "a.csv", lines, blank))
    assert np.array_equal(bodies.state, state)
    assert np.array_equal(bodies.joints_kinect_m, np.where(state[..., None] == 0, np.nan, joints), equal_nan=True)
    assert bodies.timestamp_ns.tolist() == [round(i * 1e9 / 30) for i in range(frames)]
    assert (bodies.end_ns, set(bodies.track_id.tolist())) == (bodies.timestamp_ns[-1], {1})


def test_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "data"
    assert run(["import", "kimore-csv", str(write(tmp_path / "a.csv", standing(31))), "--out", str(out)]) == 0
    assert "31 poses of 1 tracks in 1.0 s, camera 1.10 m high, looking 5.7 deg down" in capsys.readouterr().out
    episode = load(out, truth=True)[0]
    np.testing.assert_allclose(episode.poses.joints_m[7], in_episode(2.7), atol=1e-5)
    assert verify_files(out) == []
    assert verify_episode(episode) == []


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ([], "is empty; expected one line of 100 fields"),
        ([standing(1)[0][:200]], r"line 21: \d+ fields; expected 25 x"),
        ([standing(1)[0], "1," * 101], "line 22: more than 100 fields"),
        (["1," + standing(1)[0]], "line 21: more than 100 fields; .*with times: import kinect-csv"),
        ([standing(1)[0], "", standing(1)[0]], "line 22: 1 fields"),
        (["x," * 100], "line 21: .*expected numbers only"),
        (["x,y,z,state," * 25], "line 21: .*expected numbers only"),
        (["nan,0,1,2," * 25], r"line 21: joint 0 lies at \[nan"),
        (["0,0,1,2," * 24 + "0,0,-inf,1,"], r"line 21: joint 24 lies at \[0.0, 0.0, -inf"),
        (["0,0,2500,2," * 25], "line 21: joint 0 lies at .*millimetres"),
        (["0,0,1,5," * 25], "line 21: joint 0 has state 5"),
        (["0,0,1,nan," * 25], "line 21: joint 0 has state nan"),
    ],
)
def test_damage_is_named(tmp_path: Path, lines: list[str], message: str) -> None:
    refused(read_kimore_csv, write(tmp_path / "damaged.csv", lines), message)


def test_not_text_and_limits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes("1,2".encode("utf-16"))
    refused(read_kimore_csv, path, "byte 0 is not ASCII")
    write(path, standing(4))
    monkeypatch.setattr(kimore_csv, "MAX_FRAMES", 3)
    refused(read_kimore_csv, path, "4 lines; expected at most 3 frames")
    monkeypatch.setattr(kimore_csv, "MAX_BYTES", 100)
    refused(read_kimore_csv, path, "more than 100 bytes")


@ANY_FILE
@given(data=st.data())
def test_mutations_are_read_or_refused(tmp_path: Path, data: st.DataObject) -> None:
    sound = ("\n" * 5 + "\n".join(standing(3))).encode()
    refused_or_read(read_kimore_csv, tmp_path / "mutated.csv", data.draw(mutated(sound)))
