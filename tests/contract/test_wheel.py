"""The wheel alone, in an environment with what it depends on and nothing else, checks and scores."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

import hsbench
from hsbench.evaluation.code_hash import code_sha256
from hsbench.evaluation.report import read_report
from hsbench.submission import Metadata, write_submission
from hsbench.tasks import task

ROOT = Path(hsbench.__file__).parents[1]
EXTRA = ("torch", "pyrender", "OpenGL", "trimesh", "embreex", "h5py", "rerun", "matplotlib", "distributed", "shapely")
"""What only extras bring: none of it may be there, nor be missed."""


def call(*words: object, cwd: Path) -> str:
    """Run a command without anything of this checkout in its environment."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "VIRTUAL_ENV"))}
    command = [str(word) for word in words]
    done = subprocess.run(command, cwd=cwd, env=kept, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
def test_the_wheel_alone_checks_and_scores(rgbd: Path, tmp_path: Path) -> None:
    pip = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir"]
    call(*pip, tmp_path / "dist", ROOT, cwd=tmp_path)
    (wheel,) = (tmp_path / "dist").glob("hsbench-*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    assert not any(name.startswith(("tests/", "docs/", "generators/")) for name in names)
    assert "hsbench/py.typed" in names
    call(sys.executable, "-m", "venv", tmp_path / "venv", cwd=tmp_path)
    own = tmp_path / "venv" / ("Scripts" if os.name == "nt" else "bin")
    call(own / "python", "-m", "pip", "install", "--quiet", "-c", ROOT / "constraints.txt", wheel, cwd=tmp_path)
    seen = f"import importlib.util as u; print([n for n in {EXTRA} if u.find_spec(n)], u.find_spec('hsbench').origin)"
    found = call(own / "python", "-c", seen, cwd=tmp_path).split()
    assert found[0] == "[]"
    assert Path(found[1]).is_relative_to(tmp_path)

    spec = task("scene-completion")
    template = tmp_path / "template"
    on_data = ["--task", spec.name, "--data", rgbd, "--split", "val"]
    call(own / "hsbench", "task", "template", spec.name, *on_data[2:], "--out", template, cwd=tmp_path)
    assert "no faults" in call(own / "hsbench", "check", template, *on_data, cwd=tmp_path)
    call(own / "hsbench", "score", template, *on_data, "--out", tmp_path / "theirs.json", cwd=tmp_path)
    assert read_report(tmp_path / "theirs.json").provenance.code_sha256 == code_sha256()
    ours = [sys.executable, "-m", "hsbench.cli.main", "score", template, *on_data, "--out", tmp_path / "ours.json"]
    call(*ours, cwd=ROOT)
    for suffix in (".json", ".parquet", ".html"):
        theirs = (tmp_path / "theirs.json").with_suffix(suffix).read_bytes()
        assert theirs == (tmp_path / "ours.json").with_suffix(suffix).read_bytes(), suffix
    write_submission(tmp_path / "bad", spec, Metadata(spec.name, spec.version, "none", "poses"), [])
    bad = subprocess.run([own / "hsbench", "check", tmp_path / "bad", *on_data], cwd=tmp_path, check=False)
    assert bad.returncode == 3
