"""The hash of the code that scores covers every module that a score can depend on."""

from __future__ import annotations

import subprocess
import sys

from hsbench.evaluation.code_hash import SCORING, code_sha256
from tests.contract.test_imports import RANK

MODULES = "errors", "typing"


def test_it_covers_what_evaluation_may_import() -> None:
    below = {name for name, rank in RANK.items() if rank < RANK["evaluation"]}
    assert {*SCORING, *MODULES} == below - {"synth"} | {"evaluation"}


def test_it_covers_all_that_scoring_loads() -> None:
    code = (
        "import sys; from hsbench.evaluation.score import score; from hsbench.evaluation.scorers import SCORERS\n"
        "print(*{n.split('.')[1] for n in sys.modules if n.startswith('hsbench.')})"
    )
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert set(loaded) <= {*SCORING, *MODULES}


def test_it_is_a_sha256_and_stays_in_a_run() -> None:
    assert len(code_sha256()) == 64
    assert int(code_sha256(), 16) >= 0
    assert code_sha256() == code_sha256()
