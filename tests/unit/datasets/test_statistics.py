"""Counts of a data set, against counts by other means: pathlib, pandas and the episodes themselves."""

from __future__ import annotations

import shutil
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from hsbench import load
from hsbench.datasets.statistics import KINDS, Classes, class_balance, split_counts
from hsbench.errors import DataError
from hsbench.schema.states import Action, Affordance

OLD = Path(__file__).parents[2] / "fixtures" / "schema-0.2"


def test_splits_and_their_bytes() -> None:
    data = load(OLD)
    rows = tuple({**row, "split": split} for row, split in zip(data.rows, ("", "val", "train"), strict=True))
    counts = split_counts(replace(data, rows=rows))
    assert list(counts) == ["train", "val", ""]
    for row in rows:
        found = counts[row["split"]]
        assert (found.episodes, found.scenes) == (1, 1)
        assert (found.frames, found.poses) == (row["n_frames"], row["n_poses"])
        folder = OLD / "episodes" / row["episode_id"]
        sizes = {p.relative_to(folder).as_posix(): p.stat().st_size for p in folder.rglob("*") if p.is_file()}
        assert set(found.bytes_on_disk) == set(KINDS)
        assert sum(found.bytes_on_disk.values()) == sum(sizes.values())
        for kind, prefix in (("pictures", ("recording/", "inputs/frames/")), ("truth", ("truth/",))):
            assert found.bytes_on_disk[kind] == sum(n for name, n in sizes.items() if name.startswith(prefix))
        assert found.bytes_on_disk["poses"] == sizes.get("inputs/poses.parquet", 0)


def test_classes_are_those_of_the_episodes() -> None:
    data = load(OLD, truth=True)
    balance = sum(class_balance(data), Classes())
    objects, actions, cells, people, labelled = Counter(), Counter(), Counter(), [], 0
    for episode in data:
        truth = episode.truth
        if truth.objects is not None:
            objects.update(pd.read_parquet(OLD / "episodes" / episode.episode_id / "truth/objects.parquet")["category"])
        if truth.poses is not None:
            actions.update(Action(a).name.lower() for a in truth.poses.action)
            people.append(len(set(truth.poses.poses.track_id.tolist())))
        for value in truth.affordance.labels[~truth.affordance.ignored].ravel().tolist():
            cells.update(bit.name.lower() for bit in Affordance if value & (1 << bit))
            labelled += value > 0
    assert (balance.people, balance.largest_group) == (sum(people), max(people))
    assert balance.objects == objects
    assert balance.actions == actions
    assert (balance.affordance_cells, balance.labelled_cells) == (cells, labelled)
    assert np.all(np.array(list(cells.values())) <= labelled)


def test_without_truth_nothing_is_known_and_damage_is_named(tmp_path: Path) -> None:
    copy = Path(shutil.copytree(OLD, tmp_path / "data"))
    (copy / "episodes" / "film-1" / "truth" / "poses.parquet").write_bytes(b"")
    with pytest.raises(DataError, match=r"film-1/truth/poses\.parquet cannot be read"):
        sum(class_balance(load(copy)), Classes())
    for folder in copy.glob("episodes/*/truth"):
        shutil.rmtree(folder)
    assert sum(class_balance(load(copy)), Classes()) == Classes()
