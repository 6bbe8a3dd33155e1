"""Both boards of affordance-view, from files to report, against plain loops over every pixel and every moment."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from hsbench import load
from hsbench.evaluation.score import score
from hsbench.schema.occupancy import VIEW_UNSCORED
from hsbench.submission import SubmissionWriter
from hsbench.tasks import task
from hsbench.truth.view_affordance import stored_view
from tests.contract.test_tasks import metadata
from tests.reference import affordance_from_tasks as loops
from tests.reference import watched_from_docs as watched


def expected(truths: Mapping[str, np.ndarray], said: Mapping[str, list]) -> dict[str, Fraction | None]:
    """Every metric of one moment. truths: bits of labels, walkable, sittable, interactable, and of void pixels."""
    episodes = [
        (
            [[[bool(pixel >> label & 1) for pixel in row] for row in bits.tolist()] for label in range(3)],
            said[episode_id],
            [[bool(pixel & VIEW_UNSCORED) for pixel in row] for row in bits.tolist()],
        )
        for episode_id, bits in truths.items()
    ]
    return loops.metric(episodes) | {f"exclusive/{name}": v for name, v in loops.exclusive(episodes).items()}


@pytest.mark.slow
@pytest.mark.parametrize(("dataset", "observed_s"), [("activity-360", 120.0), ("timelapse-activity", 3600.0)])
def test_a_board_of_views(dataset: str, observed_s: float, data_of: Callable[[str], Path], tmp_path: Path) -> None:
    data = load(data_of(dataset), "val", truth=True, frames=False)
    spec = task("affordance-view").on(dataset)
    rng = np.random.default_rng(5)
    truths = {episode.episode_id: stored_view(episode) for episode in data}
    lasts_s = {episode.episode_id: episode.duration_s for episode in data}
    with SubmissionWriter(tmp_path / "s", spec, metadata(spec, "poses")) as writer:
        for episode_id, bits in truths.items():
            true = np.stack([bits >> label & 1 for label in range(3)]).astype(bool)
            for right, seconds in ((0.6, observed_s), (0.9, None)):
                noisy = np.where(rng.random(true.shape) < right, true, rng.random(true.shape) < 0.5)
                writer.add(episode_id, noisy, seconds)
    report = score(spec.name, tmp_path / "s", load(data_of(dataset), "val", frames=False))
    (moment,) = report.curve.moments
    points = []
    for seconds, metrics in ((observed_s, moment.metrics), (None, report.metrics)):
        said = watched.answers(tmp_path / "s", lasts_s, "probability", seconds)
        values = expected(truths, said)
        assert metrics.keys() == values.keys()
        for name, value in values.items():
            assert metrics[name].value == (None if value is None else pytest.approx(float(value), abs=1e-12)), name
        points.append((report.curve.whole_s if seconds is None else seconds, float(values["mean-iou"])))
    assert report.curve.whole_s == max(lasts_s.values())
    assert report.curve.area.value == pytest.approx(watched.area(points), abs=1e-12)
    assert 0.1 < points[0][1] < points[1][1] < 0.99
