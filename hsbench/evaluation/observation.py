"""Scores over the length of observation: the split after each earlier time that a submission answers at.

An answer at a time is scored on the same truth as the whole one. An episode that ended before a time stands there with
its whole answer, so that every point of a curve is of the same episodes and the last is the number of the board.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from hsbench.errors import SchemaError
from hsbench.evaluation.pooled import area_value, summarise
from hsbench.evaluation.report import EpisodeRow, Moment, ObservationCurve
from hsbench.evaluation.scorers import metrics_of
from hsbench.tasks.spec import TaskSpec


@dataclass(frozen=True)
class Watched:
    """The rows of one episode: of the whole answer, and of those given after fewer seconds than it lasts."""

    whole: EpisodeRow
    duration_s: float
    earlier: Mapping[float, EpisodeRow]

    def at(self, observed_s: float) -> EpisodeRow:
        """The row after so many seconds."""
        return self.whole if observed_s >= self.duration_s else self.earlier[observed_s]


def curve_of(episodes: Sequence[Watched], spec: TaskSpec, *, seed: int, replicates: int) -> ObservationCurve | None:
    """The curve of a split; None where no answer is earlier. episodes: ascending by id.

    Raises SchemaError for an answer at no observation time, and where one episode has an answer and another that lasts
    beyond that time has none.
    """
    times = _times(episodes, spec)
    if not times:
        return None
    rows = [[episode.at(observed_s) for episode in episodes] for observed_s in times]
    whole_s = min(max(episode.duration_s for episode in episodes), spec.observation_times_s[-1])
    moments = tuple(
        Moment(observed_s, summarise(at, spec.name, seed=seed, replicates=replicates), tuple(at))
        for observed_s, at in zip(times, rows, strict=True)
    )
    rows.append([episode.whole for episode in episodes])
    primary = metrics_of(spec.name)[spec.primary_metric]
    return ObservationCurve(
        moments, whole_s, area_value((*times, whole_s), rows, primary, seed=seed, replicates=replicates)
    )


def _times(episodes: Sequence[Watched], spec: TaskSpec) -> list[float]:
    for episode in episodes:
        allowed = [t for t in spec.observation_times_s[:-1] if t < episode.duration_s]
        for observed_s in sorted(episode.earlier.keys() - set(allowed)):
            known = ", ".join(f"{t:g}" for t in allowed) or "none"
            raise SchemaError(f"{_after(episode, 'an', observed_s)}; times apart are {known} s")
    times = sorted({observed_s for episode in episodes for observed_s in episode.earlier})
    for episode in episodes:
        for observed_s in times:
            if observed_s < episode.duration_s and observed_s not in episode.earlier:
                raise SchemaError(f"{_after(episode, 'no', observed_s)}; other episodes have one")
    return times


def _after(episode: Watched, found: str, observed_s: float) -> str:
    lasts = f"{observed_s:g} s of {episode.duration_s:g} s"
    return f"episode {episode.whole.episode_id} has {found} answer after {lasts}"
