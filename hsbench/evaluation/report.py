"""The report: everything a score says, with what it was computed from and by. No time, host or path: the same
submission on the same truth gives the same bytes anywhere.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from hsbench.errors import DataError, SchemaError
from hsbench.io.atomic import write_json
from hsbench.io.plain import from_plain, to_plain
from hsbench.io.strict_json import read_json
from hsbench.submission.metadata import Metadata

FORMAT = "hsbench-report/1"
"""Written into every report file; raised when a field changes its meaning."""

BEFORE_CURVES = "hsbench-report/0"
"""Had no curve, and neither hash in its provenance; still read."""

MAX_COUNT = 2**53
"""Beyond it a count would not survive readers that know only floating point."""

MAX_REPLICATES = 100_000
"""So that recomputing a stranger's report ends."""


@dataclass(frozen=True)
class DatasetRef:
    """Which data were scored: name, version, and sha256 of the manifest file that vouches for every byte."""

    name: str
    version: str
    manifest_sha256: str


@dataclass(frozen=True)
class MetricValue:
    """One pooled metric. None = undefined, never 0 or NaN.

    low, high: percentile interval over scenes; None with a ``reason`` where there is none.
    mean_over_episodes: of the episodes where it is defined; undefined_episodes: how many others there are.
    """

    value: float | None
    low: float | None
    high: float | None
    mean_over_episodes: float | None
    undefined_episodes: int
    undefined_replicates: int
    reason: str | None = None

    def __post_init__(self) -> None:
        if (self.low is None) != (self.high is None) or (
            self.low is not None and self.high is not None and self.low > self.high
        ):
            raise SchemaError(f"interval {self.low} .. {self.high} is not one")


@dataclass(frozen=True)
class Primary:
    """The number of the board: a metric of the report by name, repeated where nobody can miss it."""

    name: str
    value: float | None
    low: float | None
    high: float | None


@dataclass(frozen=True)
class EpisodeRow:
    """One episode: whether its prediction was missing, and its sufficient statistics by name.

    statistics: counts that add up over episodes, or lists that a metric joins; the task's scorer names them.
    """

    episode_id: str
    scene_id: str
    missing: bool
    statistics: Mapping[str, tuple[int, ...]]

    def __post_init__(self) -> None:
        for name, row in self.statistics.items():
            if not all(0 <= count < MAX_COUNT for count in row):
                raise SchemaError(f"episode {self.episode_id}: {name} holds {row}; expected counts 0 .. 2^53")


@dataclass(frozen=True)
class ReportCounts:
    """Episodes with a prediction, without one (scored as the task's missing answer), with undefined primary; scenes."""

    scored: int
    missing: int
    undefined: int
    scenes: int


@dataclass(frozen=True)
class Moment:
    """The split after the first ``observed_s`` seconds; episodes that ended before stand with their whole answer.

    episodes: those of the report, in its order.
    """

    observed_s: float
    metrics: Mapping[str, MetricValue]
    episodes: tuple[EpisodeRow, ...]


@dataclass(frozen=True)
class ObservationCurve:
    """What more watching bought: the split at earlier times, of a submission that answers there.

    moments: ascending, before ``whole_s``, the seconds that the report's own numbers stand for: the length of the
    longest episode, or the task's last time where that is shorter. area: of the primary metric over log time, in its
    own unit (``hsbench.metrics.curves``).
    """

    moments: tuple[Moment, ...]
    whole_s: float
    area: MetricValue

    def __post_init__(self) -> None:
        times = (0.0, *(moment.observed_s for moment in self.moments), self.whole_s)
        if len(times) < 3 or any(a >= b for a, b in pairwise(times)):
            raise SchemaError(f"curve has times {times[1:]}; expected two or more that ascend from above 0 s")


@dataclass(frozen=True)
class Provenance:
    """What computed the numbers from what: package version, version of the protocol's rules, and the resampling.

    code_sha256: of the code that scores (``code_sha256``), None in reports of format 0. split_sha256: of the episodes
    that were scored and their scenes (``split_sha256``).
    """

    hsbench: str
    protocol_version: str
    code_sha256: str | None
    split_sha256: str
    seed: int
    replicates: int
    level: float

    def __post_init__(self) -> None:
        if not 1 <= self.replicates <= MAX_REPLICATES or self.seed < 0:
            raise SchemaError(
                f"replicates {self.replicates}, seed {self.seed}; expected 1 .. {MAX_REPLICATES} and a seed >= 0"
            )


@dataclass(frozen=True)
class Report:
    """A scored submission. ``episodes`` ascend by id; pooled values follow from them alone (``pooled.recompute``).

    curve: None where the submission answers for whole observations alone.
    """

    task: str
    task_version: str
    protocol: str
    dataset: DatasetRef
    split: str
    method: Metadata
    primary: Primary
    metrics: Mapping[str, MetricValue]
    counts: ReportCounts
    episodes: tuple[EpisodeRow, ...]
    curve: ObservationCurve | None
    provenance: Provenance

    def __post_init__(self) -> None:
        ids = [row.episode_id for row in self.episodes]
        if ids != sorted(set(ids)):
            raise SchemaError("report.episodes do not ascend strictly by episode_id")
        scenes = [row.scene_id for row in self.episodes]
        for moment in () if self.curve is None else self.curve.moments:
            if [(row.episode_id, row.scene_id) for row in moment.episodes] != list(zip(ids, scenes, strict=True)):
                raise SchemaError(f"report.curve after {moment.observed_s:g} s is not of the report's episodes")
        if self.provenance.split_sha256 != (own := split_sha256(self.episodes)):
            raise SchemaError(f"report.provenance.split_sha256 is not {own}, that of its episodes")
        missing = sum(row.missing for row in self.episodes)
        if (self.counts.scored, self.counts.missing) != (len(ids) - missing, missing):
            raise SchemaError(
                f"report.counts say {self.counts.scored} scored, {self.counts.missing} missing; "
                f"episodes say {len(ids) - missing} and {missing}"
            )
        named = self.metrics.get(self.primary.name)
        if named is None or (named.value, named.low, named.high) != (
            self.primary.value,
            self.primary.low,
            self.primary.high,
        ):
            raise SchemaError(f"report.primary differs from report.metrics[{self.primary.name!r}]")
        for item, said, got in (
            ("task", self.task, self.method.task),
            ("task_version", self.task_version, self.method.task_version),
        ):
            if said != got:
                raise SchemaError(f"report.{item} is {said!r} but its submission says {got!r}")

    def to_json(self) -> dict[str, Any]:
        """The object of ``report.json``."""
        return {"format": FORMAT, **to_plain(self)}

    @classmethod
    def from_json(cls, value: Any) -> Report:
        """The inverse of ``to_json``. Raises DataError naming the item that is missing, unknown or wrong."""
        if not isinstance(value, dict) or value.get("format") not in (FORMAT, BEFORE_CURVES):
            found = value.get("format") if isinstance(value, dict) else type(value).__name__
            raise DataError(f"report.format is {found!r}; expected {FORMAT!r} (a report.json of another version?)")
        if value["format"] == BEFORE_CURVES:
            value = _with_curve(value)
        return from_plain(cls, {key: item for key, item in value.items() if key != "format"}, "report")


def split_sha256(rows: Sequence[EpisodeRow]) -> str:
    """Of which episodes were scored, in which scenes: lower-case hex sha256 of a line ``episode scene`` each."""
    lines = "".join(f"{row.episode_id} {row.scene_id}\n" for row in rows)
    return hashlib.sha256(lines.encode()).hexdigest()


def _with_curve(value: dict[str, Any]) -> dict[str, Any]:
    """A report of format 0 as one of today; what is wrong with it is told by who reads it."""
    rows, provenance = value.get("episodes"), value.get("provenance")
    if not isinstance(provenance, dict) or not isinstance(rows, list):
        return value
    known = from_plain(_Rows, {"episodes": rows}, "report")
    added = {"code_sha256": None, "split_sha256": split_sha256(known.episodes)}
    return {**value, "curve": None, "provenance": {**provenance, **added}}


@dataclass(frozen=True)
class _Rows:
    episodes: tuple[EpisodeRow, ...]


def write_report(path: str | Path, report: Report) -> None:
    """Write ``report.json``, atomically; the same report gives the same bytes."""
    write_json(path, report.to_json())


def read_report(path: str | Path) -> Report:
    """Read ``report.json``. Raises DataError naming the file and the item."""
    value = read_json(path)
    try:
        return Report.from_json(value)
    except DataError as error:
        raise DataError(f"{path}: {error}") from error
