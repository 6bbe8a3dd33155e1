"""``hsbench view``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from hsbench.cli.common import ANY_PATH, FOLDER, progress

if TYPE_CHECKING:
    from hsbench.schema import Episode


@click.command(
    epilog="Example: hsbench view data/rgbd --episode rgbd-activity-000000 --out pictures",
    short_help="an episode as a contact sheet and a clip",
)
@click.argument("data", type=FOLDER)
@click.option("--episode", "episode_id", metavar="ID", help="Which episode; the first of the data set by default.")
@click.option("--out", type=ANY_PATH, default=Path(), help="Folder for ID.png and the clip; here by default.")
@click.option("--clip", type=click.Choice(["webp", "mp4", "none"]), default="webp", show_default=True)
@click.option("--pictures", type=click.IntRange(min=1), default=12, show_default=True, help="In the contact sheet.")
@click.option(
    "--rate", "rate_hz", type=click.FloatRange(min=0.1, max=60), default=8.0, show_default=True, help="Of the clip."
)
@click.option(
    "--height", "height_px", type=click.IntRange(64, 2160), default=360, show_default=True, help="Of a frame."
)
@click.option("--rerun", type=ANY_PATH, metavar="FILE.rrd", help="Also log everything for the Rerun viewer.")
@click.option(
    "--prediction",
    type=ANY_PATH,
    metavar="SUBMISSION",
    help="Draw this beside truth instead: ID-prediction.png and an interactive ID-prediction.html.",
)
@click.pass_context
def command(
    context: click.Context,
    data: Path,
    episode_id: str | None,
    out: Path,
    clip: str,
    pictures: int,
    rate_hz: float,
    height_px: int,
    rerun: Path | None,
    prediction: Path | None,
) -> None:
    """Draw an episode of DATA (a data set, or the folder of one episode): frames with the observed poses and depth, as
    one sheet and as a short film. The plan of the room is drawn first where truth is there.

    With --prediction, an episode's answer in a submission of scene-completion or object-detection-3d beside truth.
    """
    if prediction is not None:
        _refuse_beside_prediction(context)
        _draw_prediction(data, episode_id, prediction, out)
        return
    import numpy as np

    from hsbench.errors import HsbenchError
    from hsbench.io.atomic import write_bytes
    from hsbench.io.images import encode_png
    from hsbench.viz.clip import write_clip
    from hsbench.viz.contact_sheet import scene_cell, sheet
    from hsbench.viz.frames import annotated
    from hsbench.viz.rerun_log import write_rerun

    episode = _read(data, episode_id)
    count = len(episode.frames)
    if rerun is not None:
        write_rerun(rerun, episode)
        click.echo(f"{rerun}: open it with `rerun {rerun}`")
    if not count:
        raise HsbenchError(f"episode {episode.episode_id} has no pictures (generated with --frames none?)")
    out.mkdir(parents=True, exist_ok=True)
    chosen = np.unique(np.linspace(0, count - 1, min(pictures, count)).round().astype(int))
    cells = [annotated(episode, int(index), height_px) for index in chosen]
    if episode.truth is not None and episode.truth.scene is not None:
        cells.insert(0, scene_cell(episode))
    page = out / f"{episode.episode_id}.png"
    write_bytes(page, encode_png(sheet(cells, columns=2 if cells[-1].shape[1] > 2 * height_px else 3)))
    click.echo(f"{page}: {len(chosen)} of {count} frames")
    if clip != "none":
        film = out / f"{episode.episode_id}.{clip}"
        write_clip(
            film, (annotated(episode, k, height_px) for k in progress(range(count), count, "view", "frame")), rate_hz
        )
        click.echo(f"{film}: {count} frames, {count / rate_hz:.1f} s")


OF_FRAMES = ("clip", "pictures", "rate_hz", "height_px", "rerun")
"""Options that say how frames are drawn."""


def _refuse_beside_prediction(context: click.Context) -> None:
    """Raise UsageError where an option was typed that would do nothing."""
    for option in context.command.params:
        typed = option.name in OF_FRAMES and context.get_parameter_source(option.name)
        if typed == click.core.ParameterSource.COMMANDLINE:
            raise click.UsageError(f"{option.opts[0]} is of frames; --prediction draws a picture and a page")


def _draw_prediction(data: Path, episode_id: str | None, submission: Path, out: Path) -> None:
    from hsbench.cli.view_prediction import read_answer
    from hsbench.io.atomic import write_bytes
    from hsbench.viz.prediction import draw

    episode, answer = read_answer(data, episode_id, submission)
    picture, page = draw(episode, answer)
    out.mkdir(parents=True, exist_ok=True)
    for ending, content in ((".png", picture), (".html", page)):
        file = out / f"{episode.episode_id}-prediction{ending}"
        write_bytes(file, content)
        click.echo(f"{file}: {answer.method} on {answer.task}")
    if not answer.has_truth(episode):
        click.echo(
            f"note: {episode.episode_id} has no truth for {answer.task}; the prediction is drawn alone", err=True
        )


def _read(data: Path, episode_id: str | None) -> Episode:
    """The episode to draw, with truth where it is there."""
    from hsbench.datasets.dataset import load
    from hsbench.errors import HsbenchError
    from hsbench.io.episodes import read_episode

    if (data / "episode.json").is_file():
        if episode_id is not None and episode_id != data.name:
            raise HsbenchError(f"{data} is the folder of one episode; expected no --episode, or a data set")
        return read_episode(data, truth=True)
    episodes = load(data, truth=True)
    return episodes[0] if episode_id is None else episodes.episode(episode_id)
