"""What a machine has and lacks, item by item, with what to do. Used by ``hsbench doctor``."""

from __future__ import annotations

import os
import platform
import shutil
import sys
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from hsbench.errors import HsbenchError
from hsbench.io.resources import KINDS, resource

CORE = ("numpy", "scipy", "numba", "pyarrow", "pandas", "opencv-python-headless", "scikit-image", "tqdm", "click")
EXTRAS = {
    "gen": ("trimesh", "embreex", "pyrender"),
    "torch": ("torch", "safetensors"),
    "viz": ("rerun-sdk",),
    "cluster": ("distributed",),
    "learn": ("scikit-learn",),
}
MINIMUM_PYTHON = (3, 11)
ENOUGH_DISK_GB = 5


@dataclass(frozen=True)
class Finding:
    """One item: its state (``ok``, ``absent`` = optional and not there, ``broken``), what was found, what to do."""

    item: str
    state: str
    found: str
    advice: str = ""


def examine() -> list[Finding]:
    """Everything hsbench can use on this machine."""
    return [_python(), _core(), *_extras(), _renderer(), *_resources(), _cache(), _disk()]


def _python() -> Finding:
    found = f"{platform.python_version()} on {platform.system()} {platform.machine()}, {os.cpu_count()} cores"
    if sys.version_info >= MINIMUM_PYTHON:
        return Finding("python", "ok", found)
    return Finding("python", "broken", found, "install Python 3.11 or newer")


def _core() -> Finding:
    missing = [name for name in CORE if _version(name) is None]
    if missing:
        return Finding("core packages", "broken", f"missing {', '.join(missing)}", "pip install hsbench")
    return Finding("core packages", "ok", ", ".join(f"{name} {_version(name)}" for name in CORE[:4]))


def _extras() -> list[Finding]:
    findings = []
    for extra, packages in EXTRAS.items():
        missing = [name for name in packages if _version(name) is None]
        item = f"extra [{extra}]"
        if missing:
            findings.append(Finding(item, "absent", f"no {', '.join(missing)}", f"pip install 'hsbench[{extra}]'"))
        else:
            findings.append(Finding(item, "ok", ", ".join(f"{name} {_version(name)}" for name in packages)))
    return findings


def _renderer() -> Finding:
    from hsbench.synth.render import probe

    facts = probe()
    found = ", ".join(f"{key} {value}" for key, value in facts.items() if value)
    if facts.get("egl"):
        return Finding("rendering", "ok", found)
    if not facts.get("pyrender_version"):
        return Finding("rendering", "absent", found, "pip install 'hsbench[gen]'")
    advice = "the slower ray caster draws; for OpenGL on Debian: apt-get install libegl1 libgl1 libgl1-mesa-dri"
    return Finding("rendering", "absent", found or "no renderer", advice)


def _resources() -> list[Finding]:
    findings = []
    for kind in KINDS:
        try:
            found = resource(kind)
            findings.append(
                Finding(kind, "ok", ", ".join(sorted(p.name for p in found.iterdir() if p.is_dir())) or "empty")
            )
        except HsbenchError as error:
            findings.append(Finding(kind, "broken", str(error), "install hsbench again"))
    return findings


def _cache() -> Finding:
    """Numba keeps compiled kernels beside the package; where that is read-only it needs a folder of its own."""
    place = Path(os.environ.get("NUMBA_CACHE_DIR") or Path(__file__).resolve().parents[1])
    if os.access(place, os.W_OK):
        return Finding("kernel cache", "ok", "writable")
    return Finding(
        "kernel cache", "absent", "the package folder is read-only", "set NUMBA_CACHE_DIR to a writable folder"
    )


def _disk() -> Finding:
    free_gb = shutil.disk_usage(Path.cwd()).free / 1e9
    if free_gb >= ENOUGH_DISK_GB:
        return Finding("disk", "ok", f"{free_gb:.0f} GB free here")
    return Finding("disk", "absent", f"{free_gb:.1f} GB free here", "size full of a data set needs a few GB")


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None
