"""The whole product at small size: generate, verify, predict, check, score, compare, board, page."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from hsbench.baselines.occlusion.action import recognise
from hsbench.baselines.occlusion.carve import activity_maps
from hsbench.baselines.occlusion.config import CarveConfig
from hsbench.baselines.occlusion.run import predict
from hsbench.datasets.dataset import Dataset, load
from hsbench.datasets.verify import verify_episode, verify_files
from hsbench.errors import DataError
from hsbench.evaluation.compare import compare
from hsbench.evaluation.report import write_report
from hsbench.evaluation.score import score
from hsbench.io.atomic import write_bytes, write_text
from hsbench.io.dataset_index import DATASET_FILE
from hsbench.io.images import encode_png
from hsbench.io.splits import read_splits
from hsbench.leaderboard import COLUMNS, Entry, rank, read_entries, write_entry
from hsbench.submission.check import check_or_raise
from hsbench.submission.read import Predictions, open_submission
from hsbench.synth.generate import Job, generate
from hsbench.tasks.scene_completion import GRID, SCENE_COMPLETION
from hsbench.viz.board_page import board_page
from hsbench.viz.demo_page import Shown, banner, demo_page, view_at

RECIPE = "rgbd-activity"
SENSORS_RECIPE = "all-sensors"
SENSORS_FRAMES = "every:6"  # among them for each sensor one at the moment shown
SHOWN_S = 30.0
SPLIT = "val"
METHODS = (
    "carve",
    "carve-shuffled",
    "all-solid",
    "visible-only",
    "height-prior",
    "carve-height-prior",
    "best-constant",
    "carve-swept",
)
SHOWN = ("all-solid", "carve")
AGAINST = ("all-solid", "carve-shuffled", "best-constant", "height-prior")
YEAR = 2026


@dataclass(frozen=True)
class Step:
    """One finished step of the demo, for the one who waits."""

    text: str


def demo(out: Path, workers: int, quick: bool = False) -> Iterator[Step]:
    """Run the demo into ``out``, yielding each step when it is done; the last names ``report.html``.

    quick: two training and two validation episodes only, and no pictures but the one at t0. A second run goes on with
    what is there.
    """
    if out.is_dir() and any(out.iterdir()) and not (out / "data" / DATASET_FILE).is_file():
        raise DataError(f"{out} is not empty and holds no demo; expected a new folder or one that the demo made")
    data, predictions, board = out / "data", out / "predictions", out / "board"
    units = tuple(u for u in read_splits(RECIPE).numbers("mini") if not quick or u[1] in ("train", SPLIT))
    job = Job(RECIPE, 0, units, "reference" if quick else "all")
    for made in generate(job, data, workers):
        yield Step(f"generated {made}")
    episodes = load(data, truth=True)
    faults = verify_files(data) + [fault for episode in episodes for fault in verify_episode(episode)]
    if faults:
        raise DataError("\n".join(faults))
    yield Step(f"verified {len(episodes)} episodes in {data}")

    chosen = load(data, SPLIT)
    reports = {}
    for name in METHODS:
        for _ in predict(name, chosen, predictions / name, replace_out=True):
            pass
        check_or_raise(predictions / name, SCENE_COMPLETION, chosen.episode_ids)
        report = score(SCENE_COMPLETION.name, predictions / name, load(data, SPLIT, frames=False))
        write_report(out / f"{name}.json", report)
        write_entry(board, Entry(name, YEAR, report.method.authors, "self-reported", report), replace=True)
        reports[name] = report
        yield Step(f"{name}: {SCENE_COMPLETION.primary_metric} {report.primary.value:.3f}")
    entries = read_entries(board, SCENE_COMPLETION.name, SCENE_COMPLETION.version)
    write_text(out / "board.html", board_page(rank(entries), SCENE_COMPLETION, COLUMNS))
    shown = _shown(load(data, SPLIT, truth=True), predictions)
    comparisons = [compare(reports["carve"], reports[name]) for name in AGAINST]
    write_bytes(out / "picture.png", encode_png(banner(shown[0])))
    sensors = out / "sensors"
    job = Job(SENSORS_RECIPE, 0, tuple(read_splits(SENSORS_RECIPE).numbers("mini", SPLIT)[:1]), SENSORS_FRAMES)
    for made in generate(replace(job, frames="reference") if quick else job, sensors, workers):
        yield Step(f"generated {made}")
    views = [view_at(episode, SHOWN_S) for episode in load(sensors)]
    write_text(out / "report.html", demo_page(shown, views, list(reports.values()), comparisons, commands()))
    yield Step(f"board: {out / 'board.html'}")
    yield Step(f"report: {(out / 'report.html').resolve()}")


def _shown(data: Dataset, predictions: Path) -> list[Shown]:
    """The episodes with their activity maps and the predictions that are drawn."""
    config = CarveConfig()
    answers = {}
    for name in SHOWN:
        with open_submission(predictions / name) as files:
            stored = Predictions(files, SCENE_COMPLETION)
            answers[name] = {episode_id: stored.get(episode_id) for episode_id in data.episode_ids}
    shown = []
    for episode in data:
        assert episode.poses is not None
        maps = activity_maps(recognise(episode.poses, config), GRID, config)
        grids = {name: grid for name in SHOWN if (grid := answers[name][episode.episode_id]) is not None}
        shown.append(Shown(episode, maps.stand, maps.sit, grids))
    return shown


def commands() -> list[str]:
    """What the demo does, as a user would type it."""
    return [
        f"hsbench generate {RECIPE} --size mini --out data",
        "hsbench verify data",
        f"hsbench predict carve --data data --split {SPLIT} --out predictions/carve",
        f"hsbench check predictions/carve --task scene-completion --data data --split {SPLIT}",
        f"hsbench score predictions/carve --task scene-completion --data data --split {SPLIT} --out carve.json",
        "# the same for all-solid, then",
        "hsbench compare carve.json all-solid.json",
        f"hsbench board add carve.json --board board --name carve --year {YEAR}",
        "hsbench board build --board board --out board.html",
        f"hsbench generate {SENSORS_RECIPE} --split {SPLIT} --episodes 0:1 --frames {SENSORS_FRAMES} --out sensors",
    ]
