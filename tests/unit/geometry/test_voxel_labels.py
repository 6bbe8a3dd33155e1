"""Down-sampling of labelled voxels: the source's own answers and its Python port's; one block by hand."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from hsbench.errors import SchemaError
from hsbench.geometry.voxel_labels import downsample_labels
from tests.reference.completion_inputs import downsample_blocks

ANSWERS = json.loads((Path(__file__).parents[2] / "reference" / "completion_scorers.json").read_text())["downsample"]


@pytest.mark.parametrize(("source", "tie"), [("octave", 0), ("python_port", 255)])
def test_the_sources_own_answers(source: str, tie: int) -> None:
    got = downsample_labels(downsample_blocks(), tie=tie)
    assert got.ravel().tolist() == ANSWERS[source]


def test_only_ties_of_empty_and_unlabelled_differ() -> None:
    blocks = downsample_blocks()
    ours, ports = downsample_labels(blocks), downsample_labels(blocks, tie=255)
    parts = blocks.reshape(4, 4, 6, 4, 4, 4)
    tied = (parts == 0).sum(axis=(1, 3, 5)) == (parts == 255).sum(axis=(1, 3, 5))
    assert (ours != ports).sum() == 13
    assert ((ours == 0) & (ports == 255) & tied)[ours != ports].all()


def test_a_block_counts_as_empty_above_95_percent() -> None:
    block = np.zeros(64, np.uint8)
    block[:3] = 5  # 61 of 64 are empty: 95.3 %
    assert downsample_labels(block.reshape(4, 4, 4)).tolist() == [[[0]]]
    block[3] = 5  # 60 of 64: 93.75 %
    assert downsample_labels(block.reshape(4, 4, 4)).tolist() == [[[5]]]


@pytest.mark.parametrize(
    ("labels", "options", "message"),
    [
        (np.zeros((8, 8, 6), np.uint8), {}, "three multiples of the factor 4"),
        (np.zeros((4, 4, 4), np.int64), {}, "labels have dtype int64; expected uint8"),
        (np.zeros((4, 4, 4), np.uint8), {"tie": 1}, "tie is 1"),
    ],
)
def test_bad_input(labels: np.ndarray, options: dict, message: str) -> None:
    with pytest.raises(SchemaError, match=message):
        downsample_labels(labels, **options)
