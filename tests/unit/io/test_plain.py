"""Dataclasses as plain values: exact both ways, and wrong values named by their path."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hsbench.errors import DataError, SchemaError
from hsbench.io.atomic import json_bytes
from hsbench.io.plain import from_plain, to_plain
from hsbench.io.strict_json import parse_json


@dataclass(frozen=True)
class Leaf:
    value: float | None
    kind: Literal["a", "b"] = "a"

    def __post_init__(self) -> None:
        if self.value == 13:
            raise SchemaError("value is 13")


@dataclass(frozen=True)
class Tree:
    name: str
    leaves: tuple[Leaf, ...]
    counts: Mapping[str, tuple[int, ...]]
    done: bool


trees = st.builds(
    Tree,
    st.text(),
    st.lists(
        st.builds(Leaf, st.none() | st.floats(14, allow_infinity=False), st.sampled_from(["a", "b"])), max_size=3
    ).map(tuple),
    st.dictionaries(st.text(), st.lists(st.integers(-(2**60), 2**60), max_size=3).map(tuple), max_size=3),
    st.booleans(),
)


@given(trees)
def test_round_trip_through_json(tree: Tree) -> None:
    assert from_plain(Tree, parse_json(json_bytes(to_plain(tree))), "tree") == tree


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"name": 3}, "tree.name is 3; expected text"),
        ({"leaves": {}}, "tree.leaves is {}; expected a list"),
        ({"leaves": [{"value": True, "kind": "a"}]}, "tree.leaves[0].value is True; expected a number"),
        ({"leaves": [{"value": 10**400, "kind": "a"}]}, "expected a number"),
        ({"leaves": [{"value": 1, "kind": "c"}]}, "tree.leaves[0].kind is 'c'; expected one of 'a', 'b'"),
        ({"leaves": [{"value": 13, "kind": "a"}]}, "tree.leaves[0]: value is 13"),
        ({"leaves": [{"value": 1}]}, "tree.leaves[0] lacks kind"),
        ({"counts": {"x": [1.0]}}, "tree.counts.x[0] is 1.0; expected a whole number"),
        ({"done": 1}, "tree.done is 1; expected true or false"),
        ({"more": 1}, "tree has unknown 'more'; expected exactly name, leaves, counts, done"),
    ],
)
def test_wrong_values_are_named(change: dict, words: str) -> None:
    plain = {"name": "x", "leaves": [], "counts": {}, "done": False} | change
    with pytest.raises(DataError) as error:
        from_plain(Tree, plain, "tree")
    assert words in str(error.value)
    assert "\n" not in str(error.value)
