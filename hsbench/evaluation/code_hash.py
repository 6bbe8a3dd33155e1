"""Which code computed a score: a hash of every source file that a number may depend on.

It stands for a commit, and says more: it is the same from a wheel and from a checkout, and it tells of changes that
were never committed.
"""

from __future__ import annotations

import functools
import hashlib
from pathlib import Path

from hsbench.io.resources import PACKAGE

SCORING = ("geometry", "schema", "io", "truth", "datasets", "metrics", "submission", "tasks", "evaluation")
"""The packages that evaluation may import, with ``errors`` and ``typing``, and itself."""


@functools.cache
def code_sha256() -> str:
    """Lower-case hex sha256 of the sources by relative path; of no file's time, owner or place."""
    digest = hashlib.sha256()
    for path in _sources():
        name = path.relative_to(PACKAGE).as_posix()
        digest.update(name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def _sources() -> list[Path]:
    modules = [PACKAGE / "errors.py", PACKAGE / "typing.py"]
    return modules + sorted(path for name in SCORING for path in (PACKAGE / name).rglob("*.py"))
