"""Cuboids on real depth without any activity: SUN RGB-D img_0063, whose boxes are annotated, and SSCNet's NYU0001.

Looked for in ``$HSBENCH_REALDATA``, else in ``../shared/realdata`` beside the checkout. All constants of the method are
fixed on generated data; nothing is tuned to these two frames. How many boxes are found is printed (``pytest -s``): two
frames are an example of what the method does, no score.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from hsbench.baselines.method import depth_at_t0
from hsbench.baselines.occlusion.boundary import estimate_boundary
from hsbench.baselines.occlusion.detection import NOBODY, answer, room_of
from hsbench.datasets.importers import sscnet
from hsbench.datasets.importers.captures import sscnet_episode
from hsbench.datasets.importers.room_captures import sunrgbd_episode
from hsbench.datasets.importers.sunrgbd import read_sunrgbd
from hsbench.metrics import detection
from hsbench.metrics.detection import Predictions, Truths
from hsbench.schema.episode import Episode
from hsbench.tasks.object_detection import MAX_BOXES, Boxes
from hsbench.tasks.scene_completion import GRID
from tests.real.test_sunrgbd_real import REALDATA, SUN, copied

SSC = REALDATA / "ssc"
pytestmark = pytest.mark.skipif(
    not (SUN.is_dir() and SSC.is_dir()), reason=f"needs the real captures in {REALDATA} (set HSBENCH_REALDATA)"
)
MATCH_IOU = 0.25
"""Of the primary metric of task object-detection-3d."""
SLACK_M = 0.3  # a box may reach so far behind the farthest depth: the depth of a body that shows its front alone


@pytest.fixture(scope="module")
def sun(tmp_path_factory: pytest.TempPathFactory) -> Episode:
    folder = copied(tmp_path_factory.mktemp("sunrgbd") / "img_0063")
    return sunrgbd_episode(read_sunrgbd(folder, filled=False), "img_0063")[0]


@pytest.fixture(scope="module")
def nyu() -> Episode:
    frame = sscnet.read_frame(SSC / "sscnet_NYU0001_0000_depth.png", SSC / "sscnet_NYU0001_0000.bin")
    return sscnet_episode(frame, "NYU0001", GRID)


@pytest.fixture(params=["sun", "nyu"])
def episode(request: pytest.FixtureRequest) -> Episode:
    return request.getfixturevalue(request.param)


def boxes_of(episode: Episode) -> Boxes:
    boundary = estimate_boundary(episode.sensor, depth_at_t0(episode), None)
    return answer(room_of(episode, NOBODY, boundary))


def test_the_room_is_split_into_seen_hidden_and_free(episode: Episode) -> None:
    room = room_of(episode, NOBODY, estimate_boundary(episode.sensor, depth_at_t0(episode), None))
    for part in (room.surface, room.hidden, room.free):
        assert part.any()
    assert not (room.surface & room.hidden).any()
    assert not (room.free & (room.surface | room.hidden)).any()
    assert not room.support.any(), "nobody sat"
    assert room.seats == ()


def test_boxes_stand_in_the_room_and_come_out_the_same_again(episode: Episode) -> None:
    found = boxes_of(episode)
    assert 0 < len(found.boxes) <= MAX_BOXES
    assert (found.scores[:-1] >= found.scores[1:]).all()
    assert (found.boxes[:, 2] - found.boxes[:, 5] / 2 >= -0.01).all(), "nothing below the floor"
    boundary = estimate_boundary(episode.sensor, depth_at_t0(episode), None)
    turn, back = math.cos(boundary.yaw_rad), math.sin(boundary.yaw_rad)
    along = found.boxes[:, :2] @ np.array([[turn, -back], [back, turn]])
    assert (along >= boundary.low - SLACK_M).all()
    assert (along <= boundary.high + SLACK_M).all()
    again = boxes_of(episode)
    assert (again.boxes == found.boxes).all()
    assert (again.scores == found.scores).all()


def test_some_annotated_boxes_are_found(sun: Episode) -> None:
    """Of seven, two shelves, a chair and four small things; the metric, class-agnostic, every box counted."""
    assert sun.truth is not None
    assert sun.truth.scene is not None
    truths = Truths(np.array([item.box for item in sun.truth.scene.objects]))
    found = boxes_of(sun)
    predictions = Predictions(found.boxes.astype(np.float64), found.scores.astype(np.float64))
    ranking = detection.score([truths], [predictions], "hsbench", MATCH_IOU).overall[0].ranking
    print(f"img_0063: {ranking.hits} of {ranking.truths} boxes found at IoU {MATCH_IOU} by {len(found.boxes)}")
    assert ranking.truths == 7
    assert ranking.hits >= 1
