"""The table of episodes that lies beside a report: one row an episode and observation time, every metric a column."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pyarrow as pa

from hsbench.evaluation.pooled import of_each
from hsbench.evaluation.report import EpisodeRow, Report
from hsbench.evaluation.scorers import metrics_of
from hsbench.io.atomic import atomic_file
from hsbench.io.episodes import write_parquet


def episode_table(report: Report) -> pa.Table:
    """Every metric of every episode alone, null where undefined; they are no shares of the pooled values.

    Columns ``episode_id``, ``scene_id``, ``observed_s`` (null = the whole observation), ``missing``, then the metrics
    in the order of the report. Rows ascend by observation time, the whole last, then by episode.
    """
    moments = () if report.curve is None else report.curve.moments
    parts = [_part(moment.episodes, moment.observed_s, report.task) for moment in moments]
    return pa.concat_tables([*parts, _part(report.episodes, None, report.task)])


def write_episode_table(path: str | Path, report: Report) -> None:
    """Write the table as Parquet, atomically; the same report and pyarrow give the same bytes."""
    with atomic_file(path) as file:
        write_parquet(file, episode_table(report))


def _part(rows: Sequence[EpisodeRow], observed_s: float | None, task: str) -> pa.Table:
    columns: dict[str, pa.Array] = {
        "episode_id": pa.array([row.episode_id for row in rows], pa.string()),
        "scene_id": pa.array([row.scene_id for row in rows], pa.string()),
        "observed_s": pa.array([observed_s] * len(rows), pa.float64()),
        "missing": pa.array([row.missing for row in rows], pa.bool_()),
    }
    for name, metric in metrics_of(task).items():
        values = of_each(rows, metric)
        columns[name] = pa.array(values, pa.float64(), mask=np.isnan(values))
    return pa.table(columns)
