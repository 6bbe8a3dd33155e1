"""A submission's answer for one episode, drawn beside truth: a picture and an interactive page."""

from __future__ import annotations

from dataclasses import dataclass

from hsbench.evaluation import completion
from hsbench.io.images import encode_png
from hsbench.schema.episode import Episode
from hsbench.tasks.object_detection import Boxes
from hsbench.tasks.scene_completion import GRID
from hsbench.typing import BoolArray
from hsbench.viz.prediction_boxes import boxes_picture
from hsbench.viz.prediction_page import boxes_page, completion_page
from hsbench.viz.prediction_slices import slices_picture
from hsbench.viz.verdicts import true_boxes

TASKS = ("scene-completion", "object-detection-3d")
"""Whose predictions can be drawn."""


@dataclass(frozen=True, eq=False)
class Answer:
    """What a method says of an episode, as its task decodes it: (128, 128, 48) bool, or boxes."""

    task: str
    method: str
    value: BoolArray | Boxes

    def has_truth(self, episode: Episode) -> bool:
        """Whether there is anything to compare with."""
        if isinstance(self.value, Boxes):
            return true_boxes(episode) is not None
        return completion.truth(episode) is not None


def draw(episode: Episode, answer: Answer) -> tuple[bytes, bytes]:
    """(PNG, HTML) of an answer; the episode is read with truth where it is there."""
    if isinstance(answer.value, Boxes):
        picture = boxes_picture(episode, answer.value, answer.method)
        page = boxes_page(episode, answer.value, answer.method, picture)
    else:
        picture = slices_picture(episode, answer.value, GRID, answer.method)
        page = completion_page(episode, answer.value, answer.method, picture)
    return encode_png(picture), page.encode()
