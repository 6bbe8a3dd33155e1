"""The import arrows of the design, enforced on the syntax tree of every module, and what ``import hsbench`` costs.

    errors, typing < geometry < schema < {io, truth} < {datasets, metrics, submission, synth} < tasks < evaluation
    < {leaderboard, torch, viz} < baselines < cli

Packages of one rank do not see each other. Imports inside functions and under TYPE_CHECKING count like any other.
"""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import hsbench

ROOT = Path(hsbench.__file__).parents[1]

RANKS = (
    ("errors", "typing"),
    ("geometry",),
    ("schema",),
    ("io", "truth"),
    ("datasets", "metrics", "submission", "synth"),
    ("tasks",),
    ("evaluation",),
    ("leaderboard", "torch", "viz"),
    ("baselines",),
    ("cli",),
    ("__main__",),
)
RANK = {name: rank for rank, names in enumerate(RANKS) for name in names}

HOMES = {
    "torch": ("torch", "baselines"), "safetensors": ("torch", "baselines"), "sklearn": ("baselines",),
    "matplotlib": ("viz",), "rerun": ("viz",),
    "distributed": ("synth",), "h5py": ("datasets",),
    "pyrender": ("synth",), "OpenGL": ("synth",), "embreex": ("synth",), "trimesh": ("synth",), "click": ("cli",),
}  # fmt: skip
"""Packages of an extra (and click) and the only packages of ours that may name them."""

NO_FILES = ("hsbench.io", "io", "os", "pathlib", "shutil", "tempfile", "pyarrow", "pandas", "cv2", "json", "pickle")
"""What metrics never import: they see arrays."""


def imports(tree: ast.AST, package: str) -> Iterator[tuple[int, str]]:
    """(line, dotted name) of everything a module imports, ``from a import b`` as ``a.b``; ``package`` resolves dots."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                parents = package.split(".")
                base = ".".join([*parents[: len(parents) - node.level + 1], *([base] if base else [])])
            yield from ((node.lineno, f"{base}.{alias.name}") for alias in node.names)
        elif isinstance(node, ast.Call) and node.args:
            called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            name = node.args[0]
            if isinstance(name, ast.JoinedStr) and name.values:
                name = name.values[0]
            if called in ("import_module", "__import__") and isinstance(name, ast.Constant):
                yield node.lineno, str(name.value).rstrip(".")


def violations(root: Path) -> list[str]:
    """Every import under ``root``/hsbench and ``root``/generators that goes against an arrow, a line each."""
    found = []
    for path in sorted((root / "hsbench").rglob("*.py")):
        if "bundled" in path.parts:
            continue
        parts = path.relative_to(root).with_suffix("").parts
        package = ".".join(parts[:-1])
        for line, name in imports(ast.parse(path.read_text(encoding="utf-8")), package):
            for fault in import_faults(parts, name):
                found.append(f"{path.relative_to(root)}:{line}: {fault}")
        if parts[1] == "metrics":
            found += [f"{path.relative_to(root)}:{line}: metrics open a file" for line in opened(path)]
    for path in sorted((root / "generators").rglob("*.py")):
        for line, name in imports(ast.parse(path.read_text(encoding="utf-8")), ""):
            top = name.split(".")
            if (top[0] == "hsbench" and top[1:2] not in (["synth"], ["schema"], ["geometry"], ["errors"])) or top[
                0
            ] in (
                "generators",
                "tests",
            ):
                found.append(f"{path.relative_to(root)}:{line}: a recipe imports {name}")
    return found


def import_faults(parts: tuple[str, ...], name: str) -> Iterator[str]:
    """What is wrong with module ``parts`` (``hsbench``, package, ...) importing ``name``."""
    own, target = parts[1], name.split(".")
    if target[0] in ("generators", "tests"):
        yield f"the library imports {name}"
    if target[0] in HOMES and own not in HOMES[target[0]]:
        yield f"{own} imports {name}"
    if own == "metrics" and any(name == banned or name.startswith(banned + ".") for banned in NO_FILES):
        yield f"metrics import {name}"
    if target[0] != "hsbench":
        return
    if own == "__init__":  # the root offers load and Dataset, score and Evaluator, lazily
        if target[1:3] not in ([], ["datasets", "dataset"], ["evaluation", "evaluator"], ["evaluation", "score"]):
            yield f"the root imports {name}"
    elif target[1:] not in ([], ["__version__"]):
        if target[1] not in RANK or own not in RANK:
            yield f"{own} imports {name}, of no rank"
        elif target[1] != own and RANK[target[1]] >= RANK[own]:
            yield f"{own} imports {name}, which is not below it"


def opened(path: Path) -> list[int]:
    """Lines that call the builtin ``open``."""
    calls = (n for n in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if isinstance(n, ast.Call))
    return [n.lineno for n in calls if isinstance(n.func, ast.Name) and n.func.id == "open"]


def test_every_import_follows_the_arrows() -> None:
    assert violations(ROOT) == []


def test_every_package_has_a_rank() -> None:
    inside = {
        p.stem if p.is_file() else p.name for p in (ROOT / "hsbench").iterdir() if not p.name.startswith((".", "__"))
    }
    assert inside - {"py", "bundled"} <= set(RANK)
    assert len(list(ROOT.glob("hsbench/**/*.py"))) > 100  # they were all looked at


@pytest.mark.parametrize(
    ("module", "source", "word"),
    [
        ("hsbench/geometry/a.py", "from hsbench.schema import Scene", "not below"),
        ("hsbench/geometry/a.py", "import hsbench.schema.scene as s", "not below"),
        ("hsbench/io/a.py", "from hsbench.truth.sight import ray_image", "not below"),
        ("hsbench/io/a.py", "from ..truth import sight", "not below"),
        ("hsbench/io/deep/a.py", "from ...truth import sight", "not below"),
        ("hsbench/io/a.py", "from hsbench import truth", "not below"),
        ("hsbench/io/a.py", "from .. import truth", "not below"),
        ("hsbench/truth/a.py", "def f():\n    from hsbench.io.arrays import load_npz", "not below"),
        ("hsbench/synth/a.py", "if TYPE_CHECKING:\n    from hsbench.tasks import task", "not below"),
        ("hsbench/synth/a.py", "import importlib\nimportlib.import_module('hsbench.metrics.completion')", "not below"),
        ("hsbench/synth/a.py", "import_module(f'hsbench.datasets.{x}')", "not below"),
        ("hsbench/datasets/a.py", "from hsbench.synth.seeds import Seeds", "not below"),
        ("hsbench/submission/a.py", "from hsbench.metrics import completion", "not below"),
        ("hsbench/tasks/a.py", "from hsbench.evaluation import score", "not below"),
        ("hsbench/viz/a.py", "from hsbench.leaderboard import rank", "not below"),
        ("hsbench/evaluation/a.py", "from hsbench import load", "no rank"),
        ("hsbench/newcomer/a.py", "from hsbench.io import arrays", "no rank"),
        ("hsbench/errors.py", "from hsbench.typing import AnyArray", "not below"),
        ("hsbench/__init__.py", "from hsbench.synth import generate", "the root imports"),
        ("hsbench/synth/a.py", "from generators import x", "the library imports"),
        ("hsbench/metrics/a.py", "from hsbench.io.arrays import load_npz", "metrics import"),
        ("hsbench/metrics/a.py", "from pathlib import Path", "metrics import"),
        ("hsbench/metrics/a.py", "def f(p):\n    return open(p)", "metrics open"),
        ("hsbench/metrics/a.py", "import torch", "metrics imports torch"),
        ("hsbench/evaluation/a.py", "def f():\n    import matplotlib.pyplot as plt", "evaluation imports matplotlib"),
        ("generators/x/x.py", "from hsbench.io.arrays import load_npz", "a recipe imports"),
        ("generators/x/x.py", "import hsbench", "a recipe imports"),
        ("generators/x/x.py", "from hsbench.tasks.scene_completion import GRID", "a recipe imports"),
    ],
)  # fmt: skip
def test_a_planted_violation_is_found(tmp_path: Path, module: str, source: str, word: str) -> None:
    path = tmp_path / module
    path.parent.mkdir(parents=True)
    (tmp_path / "hsbench").mkdir(exist_ok=True)
    path.write_text("from typing import TYPE_CHECKING\nx = 'y'\n" + source)
    (fault,) = {f.split(": ", 1)[1] for f in violations(tmp_path)}
    assert word in fault


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("hsbench/schema/a.py", "from hsbench.geometry.cameras import Camera\nfrom hsbench.errors import SchemaError"),
        ("hsbench/submission/a.py", "from hsbench.io.arrays import load_npz\nfrom .layout import X"),
        ("hsbench/synth/a.py", "from hsbench import __version__\nfrom hsbench.truth.sight import x\nimport pyrender"),
        ("hsbench/cli/a.py", "import click\nfrom hsbench.baselines.occlusion.run import predict"),
        ("hsbench/__init__.py", "import_module('hsbench.datasets.dataset')"),
        ("generators/x/x.py", "import numpy\nfrom hsbench.synth.rooms import x\nfrom hsbench.schema import Episode"),
    ],
)  # fmt: skip
def test_what_the_arrows_allow_is_let_be(tmp_path: Path, module: str, source: str) -> None:
    path = tmp_path / module
    path.parent.mkdir(parents=True)
    path.write_text(source)
    assert violations(tmp_path) == []


# ---------------------------------------------------------------- what importing costs

HEAVY = (
    "torch", "pyrender", "trimesh", "cv2", "pandas", "matplotlib", "pyarrow", "numba", "scipy", "click", "OpenGL",
    "embreex", "skimage", "tqdm",
)  # fmt: skip


def python(code: str) -> str:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True).stdout


def test_import_loads_numpy_and_little_else() -> None:
    loaded = python("import sys, hsbench; print(*sorted({m.split('.')[0] for m in sys.modules}))").split()
    assert "hsbench" in loaded
    assert sorted(set(HEAVY) & set(loaded)) == []
    ours = python("import sys, hsbench; print(*sorted(m for m in sys.modules if m.startswith('hsbench')))").split()
    assert ours == ["hsbench"]


def test_offered_names_are_there_and_no_other() -> None:
    assert python("import hsbench; print(hsbench.load.__module__, hsbench.Dataset.__name__)").split() == [
        "hsbench.datasets.dataset",
        "Dataset",
    ]
    assert python("import hsbench; print(hsbench.score.__module__, hsbench.Evaluator.__name__)").split() == [
        "hsbench.evaluation.score",
        "Evaluator",
    ]
    with pytest.raises(AttributeError, match="no attribute 'laod'"):
        hsbench.laod  # noqa: B018
    assert dir(hsbench) == sorted(hsbench.__all__) == ["Dataset", "Evaluator", "__version__", "load", "score"]


def test_import_takes_less_than_300_ms_over_numpy() -> None:
    """The stated promise. Fresh processes, the least of five each: noise only ever adds."""
    clock = "import time; start = time.perf_counter(); import {}; print(time.perf_counter() - start)"
    numpy_s, hsbench_s = ([float(python(clock.format(name))) for _ in range(5)] for name in ("numpy", "numpy, hsbench"))
    assert min(hsbench_s) - min(numpy_s) < 0.3
