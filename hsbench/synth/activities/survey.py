"""Many lives in generated homes, measured: what ``hsbench verify --lives`` prints."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

from hsbench.synth.activities.config import MODES, LifeConfig
from hsbench.synth.activities.life import live
from hsbench.synth.activities.measures import Measures, measure
from hsbench.synth.activities.schedule import COMMON_HABITS, NOVEL_HABITS
from hsbench.synth.executors import in_order, local
from hsbench.synth.seeds import Seeds
from hsbench.synth.survey import SINGLE_EVERY, drawn_scene

PEOPLE, DURATION_S = 3, 600.0
WARM_UP_S = 20.0
HOURS = (7.5, 10.0, 13.0, 18.0, 21.0)  # of the homes in turn


def survey(count: int, seed: int, workers: int = 1) -> Iterator[Measures]:
    """Measures of the lives of three persons for ten minutes in each of some homes; half of them explore."""
    if workers == 1:
        lived(0, seed, WARM_UP_S)  # compiled functions are loaded before time is taken
    yield from in_order(local(workers), partial(lived, seed=seed), range(count))


def lived(number: int, seed: int, duration_s: float = DURATION_S) -> Measures:
    """The measures of one life; its home, hour and habits follow from its number."""
    scene = drawn_scene(_home(number), seed)
    families = COMMON_HABITS + NOVEL_HABITS
    config = LifeConfig(
        duration_s=duration_s,
        people=PEOPLE,
        mode=MODES[number % len(MODES)],
        start_hour=HOURS[number % len(HOURS)],
        habits=tuple(families[(number + k) % len(families)] for k in range(PEOPLE)),
    )
    start = time.process_time()
    life = live(scene, Seeds(seed).child("lives").child(number), config)
    lived_s = time.process_time() - start
    return replace(measure(scene, life), lived_s=lived_s)


def _home(number: int) -> int:
    """The number in the scene survey of home ``number``: single rooms left out."""
    return number + number // (SINGLE_EVERY - 1) + 1
