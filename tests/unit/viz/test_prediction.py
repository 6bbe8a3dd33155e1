"""Predictions beside truth: verdicts are the metric's, nothing is drawn that is not so, and the page holds it all."""

from __future__ import annotations

import base64
import dataclasses
import itertools
import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hsbench import load
from hsbench.geometry.boxes import iou_upright
from hsbench.metrics.completion import episode_counts
from hsbench.metrics.detection import Truths
from hsbench.schema.episode import Episode
from hsbench.tasks.object_detection import Boxes
from hsbench.tasks.scene_completion import GRID
from hsbench.typing import BoolArray, FloatArray
from hsbench.viz.prediction import Answer, draw
from hsbench.viz.prediction_slices import labels_of, slices_picture
from hsbench.viz.verdicts import COLOURS, Verdict, box_verdicts, true_boxes, voxel_verdicts

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
HOSTILE = "</script><img src=x onerror=alert(1)>&\"'"
APART = 25.0
"""CIE76 distance at which colours side by side are told apart without looking twice; one just seen is 2.3."""

# Machado, Oliveira, Fernandes, "A physiologically-based model for simulation of color vision deficiency", 2009: the
# three kinds in full, on linear rgb.
VISION = {
    "normal": np.eye(3),
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "tritanopia": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
}


@pytest.fixture(scope="module")
def episode(rgbd: Path) -> Episode:
    return load(rgbd, "val", truth=True)[0]


def solid_of(episode: Episode) -> BoolArray:
    assert episode.truth is not None
    assert episode.truth.occupancy is not None
    return episode.truth.occupancy.solid


def without_truth(episode: Episode) -> Episode:
    return dataclasses.replace(episode, truth=None)


def lab(rgb: tuple[int, int, int], vision: str) -> FloatArray:
    """CIE L*a*b* (D65) of an sRGB colour as somebody sees it."""
    c = np.array(rgb) / 255
    linear = np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)
    seen = np.clip(np.array(VISION[vision]) @ linear, 0, 1)
    xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]) @ seen
    f = np.cbrt(np.maximum(xyz / [0.9505, 1.0, 1.089], 0.008856))
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize("vision", VISION)
def test_everybody_can_tell_the_verdicts_apart(vision: str) -> None:
    judged = [COLOURS[v] for v in (Verdict.HIT, Verdict.FALSE, Verdict.MISSED)]
    around = [COLOURS[Verdict.SEEN_SOLID], COLOURS[Verdict.SEEN_FREE], COLOURS[Verdict.HIDDEN_FREE]]
    around += [COLOURS[Verdict.STRUCTURE], (255, 255, 255), (18, 18, 18)]
    pairs = [*itertools.combinations(judged, 2), *itertools.product(judged, around)]
    assert min(float(np.linalg.norm(lab(a, vision) - lab(b, vision))) for a, b in pairs) >= APART


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_voxel_verdicts_are_the_counts_of_the_metric(episode: Episode, share: float) -> None:
    assert episode.truth is not None
    truth = episode.truth.occupancy
    assert truth is not None
    occupied = np.random.default_rng(3).random(GRID.shape) < share
    labels = voxel_verdicts(truth, occupied)
    counts = episode_counts(truth, occupied)["occluded"]
    found = [int((labels == v).sum()) for v in (Verdict.HIT, Verdict.FALSE, Verdict.MISSED, Verdict.HIDDEN_FREE)]
    assert found == [counts.tp, counts.fp, counts.fn, counts.tn]
    assert counts.tp + counts.fn > 0


BOX = st.tuples(*[st.floats(0, 2)] * 3, *[st.floats(0.3, 1.5)] * 3, st.floats(-3, 3))


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(BOX, max_size=5), st.lists(st.tuples(BOX, st.integers(0, 1000)), max_size=12, unique_by=lambda b: b[1]))
def test_box_verdicts_follow_the_rule_of_the_task(true: list[tuple], said: list[tuple]) -> None:
    """Each box goes to its truth of highest IoU; a truth is hit once, by the highest score, at IoU .25."""
    truths = Truths(np.array(true).reshape(-1, 7))
    boxes = Boxes.of(np.array([box for box, _ in said]).reshape(-1, 7), np.array([s / 1000 for _, s in said]))
    iou = iou_upright(truths.boxes, boxes.boxes.astype(np.float64))
    if (np.abs(iou - 0.25) < 1e-6).any():
        return
    found, hits = np.zeros(len(true), dtype=bool), np.zeros(len(said), dtype=bool)
    for k in np.argsort(-boxes.scores):
        best = int(iou[:, k].argmax()) if len(true) else -1
        if best >= 0 and iou[best, k] >= 0.25 and not found[best]:
            found[best] = hits[k] = True
    verdicts = box_verdicts(truths, boxes)
    assert verdicts.found.tolist() == found.tolist()
    assert verdicts.hits.tolist() == hits.tolist()
    assert (verdicts.average_precision is None) == (not true)


def test_equal_scores_are_told_apart_whatever_the_order_of_rows(episode: Episode) -> None:
    truths = true_boxes(episode)
    assert truths is not None
    rows = np.concatenate([truths.boxes, truths.boxes + [0.05, 0, 0, 0, 0, 0, 0], truths.boxes + [9, 0, 0, 0, 0, 0, 0]])
    order = np.random.default_rng(1).permutation(len(rows))[:64]
    straight = box_verdicts(truths, Boxes.of(rows[np.sort(order)], np.full(len(order), 0.5)))
    mixed = box_verdicts(truths, Boxes.of(rows[order], np.full(len(order), 0.5)))
    assert (mixed.hits[np.argsort(order)] == straight.hits).all()
    assert int(straight.hits.sum()) == int(straight.found.sum()) > 0
    perfect = box_verdicts(truths, Boxes.of(truths.boxes, np.ones(len(truths.boxes))))
    assert perfect.found.all()
    assert perfect.hits.all()
    assert perfect.average_precision == 1.0


def colours_in(picture: np.ndarray) -> set[tuple[int, ...]]:
    return set(map(tuple, np.unique(picture.reshape(-1, 3), axis=0).tolist()))


def test_truth_as_prediction_shows_no_error_and_nothing_shows_no_hit(episode: Episode) -> None:
    perfect = colours_in(slices_picture(episode, solid_of(episode), GRID, "truth"))
    empty = colours_in(slices_picture(episode, np.zeros(GRID.shape, dtype=bool), GRID, "nothing"))
    assert COLOURS[Verdict.HIT] in perfect
    assert not {COLOURS[Verdict.FALSE], COLOURS[Verdict.MISSED]} & perfect
    assert COLOURS[Verdict.MISSED] in empty
    assert not {COLOURS[Verdict.FALSE], COLOURS[Verdict.HIT]} & empty


def answers(episode: Episode, method: str = "m") -> list[Answer]:
    solid = np.random.default_rng(0).random(GRID.shape) < 0.01
    boxes = Boxes.of(np.array([[2, 0, 0.5, 1, 1, 1, 0.3], [3, 1, 0.5, 0.5, 1, 1, 0]]), np.array([0.9, 0.2]))
    return [Answer("scene-completion", method, solid), Answer("object-detection-3d", method, boxes)]


@pytest.mark.parametrize("index", [0, 1])
def test_a_page_needs_nothing_and_no_text_becomes_markup(episode: Episode, index: int) -> None:
    for shown in (episode, without_truth(episode)):
        text = draw(shown, answers(shown, HOSTILE)[index])[1].decode()
        assert "<img src=x" not in text
        assert "http" not in text
        assert re.findall(r'src="(?!data:)', text) == []
        assert text.count("<script") == text.count("</script>") == 2
        assert ("no truth" in text) == (shown.truth is None)


def test_the_page_holds_the_voxels_of_each_verdict(episode: Episode) -> None:
    assert episode.truth is not None
    answer = answers(episode)[0]
    assert isinstance(answer.value, np.ndarray)
    labels = labels_of(episode.truth.occupancy, answer.value)
    sets = shapes_of(draw(episode, answer)[1].decode())["sets"]
    for entry, verdict in zip(sets, (Verdict.HIT, Verdict.FALSE, Verdict.MISSED, Verdict.SEEN_SOLID), strict=False):
        cells = np.frombuffer(base64.b64decode(entry["voxels"]), dtype=np.uint8).reshape(-1, 3)
        assert (cells == np.argwhere(labels == verdict)).all()
        assert tuple(entry["colour"]) == COLOURS[verdict]


def shapes_of(text: str) -> dict:
    found = re.search(r'id="shapes">(.*?)</script>', text, re.DOTALL)
    assert found is not None
    return json.loads(found[1])


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")
@pytest.mark.slow
def test_a_browser_draws_the_outside_of_what_is_chosen(episode: Episode, tmp_path: Path) -> None:
    """Two triangles for each face between a shown voxel and one that is not; with another mode, of its voxels."""
    solid = np.zeros(GRID.shape, dtype=bool)
    solid[20:23, 60:64, 3:5] = True
    shown = without_truth(episode)
    text = draw(shown, Answer("scene-completion", "m", solid))[1].decode()
    faces = 2 * (4 * 2 + 3 * 2 + 3 * 4)
    untick = "document.querySelector('input[data-set]').click();"
    for script, triangles in (("", 2 * faces), (untick, 0)):
        file = tmp_path / "page.html"
        file.write_text(text.replace("</body>", f"<script>{script}</script></body>"))
        command = [CHROMIUM, "--headless", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader"]
        command += ["--enable-unsafe-swiftshader", "--virtual-time-budget=2000", "--dump-dom", file.as_uri()]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
        if "data-triangles" not in done.stdout:
            pytest.skip("this Chromium has no WebGL")
        assert f'data-triangles="{triangles}"' in done.stdout
