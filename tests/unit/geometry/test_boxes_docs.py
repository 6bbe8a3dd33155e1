"""The page of boxes runs and prints what it says; its figure is the one the script draws."""

from __future__ import annotations

import doctest
import re
import runpy
from pathlib import Path

DOCS = Path(__file__).parents[3] / "docs"


def test_examples_of_the_page() -> None:
    code = "\n".join(re.findall(r"```python\n(.*?)```", (DOCS / "metrics" / "boxes.md").read_text("utf-8"), re.DOTALL))
    test = doctest.DocTestParser().get_doctest(code, {}, "boxes", "boxes", 0)
    told: list[str] = []
    result = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(test, out=told.append)
    assert result.attempted > 5
    assert result.failed == 0, "".join(told)


def test_the_figure_is_up_to_date() -> None:
    drawn = runpy.run_path(str(DOCS / "examples" / "boxes_figure.py"))["draw"]()
    assert (DOCS / "metrics" / "images" / "boxes.svg").read_text("utf-8") == drawn
