"""Labels of pixels come back as they were written; damage is one line that names the file."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hsbench.datasets.annotation.store import store_truth
from hsbench.datasets.dataset import load
from hsbench.datasets.importers.capture_set import add_capture
from hsbench.errors import DataError, HsbenchError, SchemaError
from hsbench.io.pixel_labels import PixelLabels, Thing, read_pixel_labels, write_pixel_labels
from hsbench.schema import CATEGORIES, Episode, EpisodeTruth
from hsbench.schema.episode import Frame, FrameList
from hsbench.schema.scene import PERSON_ID_OFFSET
from tests.unit.episode_builders import SENSORS, affordance

THINGS = (Thing(1, "air vent", "object"), Thing(7, "swivel chair", "chair"), Thing(59999, "Boden", "floor"))
IDS = np.zeros((18, 24), np.uint16)
IDS[2:9, 3:5], IDS[9:] = 7, 59999


def labels(*instance: np.ndarray | None) -> PixelLabels:
    return PixelLabels(tuple(100 * k for k in range(len(instance))), THINGS, instance)


@given(
    chosen=arrays(np.uint8, (3, 4), elements=st.integers(0, 3)),
    ids=st.lists(st.integers(1, PERSON_ID_OFFSET - 1), min_size=3, max_size=3, unique=True),
    kinds=st.lists(st.sampled_from(CATEGORIES), min_size=3, max_size=3),
)
def test_what_is_written_is_read(tmp_path_factory, chosen: np.ndarray, ids: list[int], kinds: list) -> None:
    folder = tmp_path_factory.mktemp("labels") / "frames"
    things = tuple(Thing(number, "näme", kind.name) for number, kind in zip(ids, kinds, strict=True))
    drawn = np.array([0, *ids], np.uint16)[chosen]
    write_pixel_labels(folder, PixelLabels((5, 9), things, (None, drawn)))
    found = read_pixel_labels(folder)
    assert (found.timestamps_ns, found.things) == ((5, 9), things)
    assert (found[0].instance, found[0].semantic, found[1].timestamp_ns) == (None, None, 9)
    assert np.array_equal(found[1].instance, drawn)
    semantic = [[dict(zip(ids, kinds, strict=True))[i].category_id if i else 0 for i in row] for row in drawn.tolist()]
    assert found[1].semantic.tolist() == semantic


def test_an_episode_keeps_them_through_another_annotation(tmp_path: Path) -> None:
    frames = FrameList(tuple(Frame(100 * k, rgb=np.zeros((18, 24, 3), np.uint8)) for k in range(2)))
    truth = EpisodeTruth(frames=labels(IDS, None))
    own = Episode("a", "lab", SENSORS["monocular"], frames, None, 0, 100, truth=truth)
    add_capture(tmp_path / "lab", own)
    stored = load(tmp_path / "lab", truth=True)[0].truth
    store_truth(tmp_path / "lab", "a", replace(stored, affordance=affordance()), ("affordance",), {})
    found = load(tmp_path / "lab", truth=True)[0].truth
    assert found.affordance is not None
    assert found.frames.things == THINGS
    assert np.array_equal(found.frames[0].instance, IDS)
    assert found.frames[1].instance is None
    assert load(tmp_path / "lab")[0].truth is None
    with pytest.raises(SchemaError, match="labels of other frames"):
        add_capture(tmp_path / "other", replace(own, truth=EpisodeTruth(frames=labels(IDS))))


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"things": [{"instance_id": 0, "name": "x", "category": "chair"}]}, "has id 0; expected 1 to 59999"),
        ({"things": [{"instance_id": 60000, "name": "x", "category": "chair"}]}, "has id 60000"),
        ({"things": [{"instance_id": 7, "name": "x", "category": "no such"}]}, "no such"),
        ({"things": [{"instance_id": 7, "name": "x", "category": "chair"}] * 2}, "stands for several things"),
        ({"things": [{"instance_id": 9, "name": "x", "category": "chair"}]}, "000000_instance.png has id 7"),
        ({"things": [{"instance_id": "7", "name": "x", "category": "chair"}]}, "expected a whole number"),
        ({"things": None}, "expected a list"),
        ({"timestamps_ns": [1.5]}, "expected a whole number"),
        ({"extra": 1}, "unknown 'extra'"),
    ],
)
def test_damage_is_named(change: dict, match: str, tmp_path: Path) -> None:
    folder = tmp_path / "frames"
    write_pixel_labels(folder, labels(IDS))
    path = folder / "labels.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(HsbenchError, match=match) as caught:
        read_pixel_labels(folder)[0]
    assert "frames/" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_damaged_pictures_are_named(tmp_path: Path) -> None:
    write_pixel_labels(tmp_path / "frames", labels(IDS))
    picture = tmp_path / "frames" / "000000_instance.png"
    picture.write_bytes(picture.read_bytes()[:60])
    with pytest.raises(DataError, match=r"000000_instance\.png is missing or no readable image"):
        read_pixel_labels(tmp_path / "frames")[0]
