"""The examples of docs/metrics run and print what their pages say; their figures are those the script draws."""

from __future__ import annotations

import doctest
import re
import runpy
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[3] / "docs"
PAGES = ("completion", "segmentation", "action", "reconstruction", "curves", "uncertainty")


@pytest.mark.parametrize("page", PAGES)
def test_examples_of_a_page(page: str) -> None:
    source = (DOCS / "metrics" / f"{page}.md").read_text(encoding="utf-8")
    code = "\n".join(re.findall(r"```python\n(.*?)```", source, re.DOTALL))
    test = doctest.DocTestParser().get_doctest(code, {}, page, page, 0)
    assert test.examples
    told: list[str] = []
    result = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(test, out=told.append)
    assert result.failed == 0, "".join(told)


def test_figures_are_up_to_date() -> None:
    figures = runpy.run_path(str(DOCS / "examples" / "metric_figures.py"))["FIGURES"]
    assert set(figures) == set(PAGES)
    for name, draw in figures.items():
        assert (DOCS / "metrics" / "images" / f"{name}.svg").read_text(encoding="utf-8") == draw(), name
