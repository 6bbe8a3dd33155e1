"""The command line: help with examples that parse, the whole sequence of work, exit codes, and JSON for machines."""

from __future__ import annotations

import json
import os
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import click
import pytest

import hsbench
from hsbench.cli.main import COMMANDS, cli, run
from hsbench.errors import HsbenchError
from hsbench.tasks import TASKS

ROOT = Path(hsbench.__file__).parents[1]


def commands(group: click.Group = cli, name: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], click.Command]]:
    """Every command with the words that call it, groups included."""
    context = click.Context(group)
    for word in group.list_commands(context):
        command = group.get_command(context, word)
        assert command is not None
        yield (*name, word), command
        if isinstance(command, click.Group):
            yield from commands(command, (*name, word))


EVERY = dict(commands())


@pytest.mark.parametrize("words", EVERY, ids=" ".join)
def test_every_command_has_help_with_an_example_that_parses(
    words: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run([*words, "--help"]) == 0
    shown = capsys.readouterr()
    assert shown.err == ""
    command = EVERY[words]
    text = " ".join(shown.out.split())
    assert command.epilog
    assert command.epilog.startswith("Example: hsbench ")
    assert " ".join(command.epilog.split()) in text
    assert command.help
    for option in command.params:
        if isinstance(option, click.Option):
            assert option.opts[-1] in text
    example = shlex.split(command.epilog.removeprefix("Example: hsbench "))
    called = max((w for w in EVERY if tuple(example[: len(w)]) == w), key=len)
    assert called[: len(words)] == words  # the example shows this command, or one of this group
    arguments = example[len(called) :]
    if "--help" not in arguments:
        with click.Context(EVERY[called]) as context:
            EVERY[called].parse_args(context, arguments)


def test_the_front_page_lists_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["--help"]) == 0
    listed = capsys.readouterr().out
    for name, summary in COMMANDS.items():
        assert f"  {name} " in listed
        assert summary.split(",")[0] in listed
    files = {p.stem.removesuffix("_command") for p in (ROOT / "hsbench" / "cli").glob("*_command.py")}
    assert files == set(COMMANDS)
    assert run(["--version"]) == 0
    assert hsbench.__version__ in capsys.readouterr().out


def test_help_is_quick_to_import() -> None:
    """The front page and a command's help load none of the heavy packages."""
    code = (
        "import sys; from hsbench.cli.main import run; run(['--help']); run(['score', '--help'])\n"
        "heavy = {'scipy', 'numba', 'pyarrow', 'cv2', 'torch', 'pandas'}\n"
        "print(sorted(heavy & {m.split('.')[0] for m in sys.modules}))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


def said(capsys: pytest.CaptureFixture[str], *arguments: object, code: int = 0) -> str:
    """Run a command in this process; its output, if it ends with ``code`` and says nothing of errors."""
    assert run([str(a) for a in arguments]) == code
    shown = capsys.readouterr()
    assert shown.err == ""
    return shown.out


def test_the_whole_sequence(
    short_recipe: Path, rgbd: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """generate, verify, info, predict, check, score, compare, board: as the issue's newcomer types it."""
    monkeypatch.chdir(tmp_path)
    generate = [
        "generate",
        short_recipe,
        "--size",
        "mini",
        "--split",
        "val",
        "--renderer",
        "raycast",
        "--out",
        "data/rgbd",
    ]
    assert "data/rgbd: 2 scenes (2 episodes made now)" in said(capsys, *generate)
    assert "(0 episodes made now)" in said(capsys, *generate)
    for unit in Path("data/rgbd/episodes").iterdir():  # the same bytes as through the library
        assert (unit / "manifest.json").read_text() == (rgbd / "episodes" / unit.name / "manifest.json").read_text()
    assert said(capsys, "verify", "data/rgbd") == "data/rgbd: 2 episodes, 0 faults\n"
    assert "val" in said(capsys, "info", "data/rgbd")
    scores = {}
    for method in ("carve", "all-solid", "height-prior"):
        extra = ["--train", rgbd] if method == "height-prior" else []
        assert f"2 predictions of {method}" in said(
            capsys, "predict", method, "--data", "data/rgbd", "--split", "val", "--out", f"pred/{method}", *extra
        )
        task = ["--task", "scene-completion", "--data", "data/rgbd"]
        assert "2 episodes, no faults" in said(capsys, "check", f"pred/{method}", *task)
        text = said(capsys, "score", f"pred/{method}", *task, "--out", f"{method}.json")
        assert "2 episodes of 2 scenes scored, 0 missing" in text
        assert "<- primary" in text
        report = json.loads(Path(f"{method}.json").read_text())
        scores[method] = report["primary"]["value"]
        assert f"{scores[method]:.4f}" in text
        assert "entry: " in said(capsys, "board", "add", f"{method}.json", "--board", "board", "--year", "2026")
    assert all(0 < value < 1 for value in scores.values())
    table = said(capsys, "board", "show", "--board", "board")
    for method, value in scores.items():
        (line,) = (row for row in table.splitlines() if f"| {method} " in row or f"| {method} |" in row)
        assert f"{100 * value:.2f}" in line
    said(capsys, "board", "build", "--board", "board", "--out", "board.html")
    assert Path("board.html").read_text().lstrip().lower().startswith("<!doctype html")
    difference = json.loads(said(capsys, "compare", "carve.json", "all-solid.json", "--json"))
    assert difference["differences"]["occluded/iou"]["estimate"] == pytest.approx(
        scores["carve"] - scores["all-solid"], abs=1e-12
    )


def test_every_next_line_can_be_pasted(rgbd: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What a command suggests as the next one runs."""
    text = said(capsys, "predict", "visible-only", "--data", rgbd, "--split", "val", "--out", tmp_path / "p")
    (next_line,) = (row.removeprefix("next: hsbench ") for row in text.splitlines() if row.startswith("next: "))
    text = said(capsys, *shlex.split(next_line))
    (next_line,) = (row.removeprefix("next: hsbench ") for row in text.splitlines() if row.startswith("next: "))
    arguments = [a if a != "report.json" else str(tmp_path / "report.json") for a in shlex.split(next_line)]
    assert "report: " in said(capsys, *arguments)


def test_json_is_json(rgbd: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said(capsys, "predict", "visible-only", "--data", rgbd, "--split", "val", "--out", tmp_path / "p")
    task = ["--task", "scene-completion", "--data", rgbd, "--split", "val"]
    shown = {
        words: json.loads(said(capsys, *words.split(), *rest, "--json"))
        for words, rest in {
            "info": [rgbd],
            "verify": [rgbd],
            "tasks": [],
            "task show": ["scene-completion"],
            "check": [tmp_path / "p", *task],
            "score": [tmp_path / "p", *task, "--out", tmp_path / "r.json"],
            "compare": [tmp_path / "r.json", tmp_path / "r.json"],
        }.items()
    }
    with_json = {" ".join(w) for w, c in EVERY.items() if any(o.name == "as_json" for o in c.params)}
    assert with_json == {*shown, "doctor", "annotate view"}  # these two are parsed in tests of their own
    assert shown["info"]["splits"]["train"]["episodes"] == 2
    assert shown["verify"] == {"data": str(rgbd), "episodes": 6, "faults": []}
    assert [t["name"] for t in shown["tasks"]] == list(TASKS)
    assert shown["task show"]["grid"]["shape"] == [128, 128, 48]
    assert shown["check"]["faults"] == []
    assert shown["score"] == json.loads((tmp_path / "r.json").read_text())
    assert {d["estimate"] for d in shown["compare"]["differences"].values()} <= {0.0, None}


def test_doctor_names_every_part(capsys: pytest.CaptureFixture[str]) -> None:
    code = run(["doctor", "--json"])
    findings = json.loads(capsys.readouterr().out)
    assert {"python", "core packages", "rendering", "generators", "splits", "leaderboards", "disk"} <= {
        f["item"] for f in findings
    }
    assert {f["state"] for f in findings} <= {"ok", "absent", "broken"}
    assert code == (2 if any(f["state"] == "broken" for f in findings) else 0)
    assert all(f["advice"] for f in findings if f["state"] != "ok")


def test_methods_are_listed(rgbd: Path, capsys: pytest.CaptureFixture[str]) -> None:
    listed = said(capsys, "predict", "--list", "--data", rgbd).splitlines()
    assert [row.split()[0] for row in listed][:2] == ["carve", "carve-shuffled"]


def test_a_reader_that_goes_away_is_no_failure() -> None:
    for arguments in (["tasks"], ["task", "show", "scene-completion"], ["--help"]):
        gone, ours = os.pipe()
        os.close(gone)
        try:
            done = subprocess.run(
                [sys.executable, "-m", "hsbench", *arguments],
                stdout=ours,
                stderr=subprocess.PIPE,
                cwd=ROOT,
                check=False,
            )
        finally:
            os.close(ours)
        assert done.stderr == b""
        assert done.returncode == 0


def test_stopping_is_130(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def stop(**_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("hsbench.cli.tasks_command.command.callback", stop)
    assert run(["tasks"]) == 130
    assert "what was written is whole" in capsys.readouterr().err


def test_a_fault_of_ours_keeps_its_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(**_: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr("hsbench.cli.tasks_command.command.callback", fail)
    with pytest.raises(ZeroDivisionError):
        run(["tasks"])


def test_a_user_error_of_many_lines_is_many_errors(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(**_: object) -> None:
        raise HsbenchError("first\nsecond")

    monkeypatch.setattr("hsbench.cli.tasks_command.command.callback", fail)
    assert run(["tasks"]) == 2
    assert capsys.readouterr().err == "error: first\nerror: second\n"
