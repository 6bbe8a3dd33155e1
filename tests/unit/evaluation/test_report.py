"""Reports on disk: nothing is lost, nothing is rounded, nothing wrong is let in."""

from __future__ import annotations

import copy
import json
from pathlib import Path

import pytest

from hsbench.errors import DataError
from hsbench.evaluation import Report, read_report, write_report
from hsbench.evaluation.pooled import recompute
from tests.unit.evaluation.reports import report


def test_round_trip_is_exact(tmp_path: Path) -> None:
    for noise in (0.0, 0.3):
        written = report(noise)
        write_report(tmp_path / "r.json", written)
        assert read_report(tmp_path / "r.json") == written
        first = (tmp_path / "r.json").read_bytes()
        write_report(tmp_path / "r.json", read_report(tmp_path / "r.json"))
        assert (tmp_path / "r.json").read_bytes() == first
        assert recompute(written) == []


def plain() -> dict:
    return json.loads(json.dumps(report(0.3).to_json()))


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        (("format",), "x", "report.format is 'x'"),
        (("split",), None, "report.split is None; expected text"),
        (("extra",), 1, "report has unknown 'extra'"),
        (("primary", "value"), 0.99, "report.primary differs"),
        (("primary", "value"), "0.9", "report.primary.value is '0.9'; expected a number"),
        (("primary", "name"), "best/iou", "report.primary differs"),
        (("counts", "missing"), 3, "episodes say 12 and 0"),
        (("counts", "missing"), True, "report.counts.missing is True; expected a whole number"),
        (("task",), "other", "report.task is 'other' but its submission says 'scene-completion'"),
        (("episodes",), {}, "report.episodes is {}; expected a list"),
        (("episodes", 0, "statistics", "occluded"), [-1, 0, 0, 0], "expected counts"),
        (("episodes", 1, "episode_id"), "ep-00", "ascend strictly"),
        (("provenance", "replicates"), 10**9, "replicates 1000000000"),
        (("metrics", "occluded/iou", "low"), None, "is not one"),
        (("metrics",), 3, "report.metrics is 3; expected an object"),
        (("method", "authors"), "me", "report.method.authors is 'me'; expected a list"),
    ],
)
def test_what_is_wrong_is_named(path: tuple, value: object, words: str) -> None:
    changed = plain()
    at = changed
    for step in path[:-1]:
        at = at[step]
    at[path[-1]] = value
    with pytest.raises(DataError) as error:
        Report.from_json(changed)
    assert words in str(error.value)


def test_every_missing_key_is_named() -> None:
    whole = plain()
    for key in whole:
        part = copy.copy(whole)
        del part[key]
        with pytest.raises(DataError, match=key):
            Report.from_json(part)


def test_no_report_at_all(tmp_path: Path) -> None:
    for text in ("[]", "{", "3"):
        (tmp_path / "r.json").write_text(text)
        with pytest.raises(DataError, match=r"r\.json"):
            read_report(tmp_path / "r.json")
    with pytest.raises(DataError, match="cannot read"):
        read_report(tmp_path / "none.json")


def test_an_edited_value_does_not_follow_from_the_rows() -> None:
    changed = plain()
    for item in (changed["primary"], changed["metrics"]["occluded/iou"]):
        item.update(value=0.9, low=0.89, high=0.91)
    faults = recompute(Report.from_json(changed))
    assert [fault.split(":")[0] for fault in faults] == ["metric 'occluded/iou'"] * 3
    assert "value is 0.9; its episodes give" in faults[0]
