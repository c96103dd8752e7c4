"""The numbers on which a verdict turns are those that the documentation lists."""

import re
from importlib import import_module
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[2] / "docs" / "diagnosis.md"
ROW = re.compile(r"^\| `([a-z_.]+)\.(_?[A-Z_]+)` \| ([0-9.]+) \|", re.MULTILINE)
MODULES = {"law": "features.law", "paces": "features.paces"}


def listed():
    """Return module, name and value of each constant that the page lists."""
    text = PAGE.read_text(encoding="utf-8").split("## The constants that decide")[1]
    return ROW.findall(text.split("\n## ")[0])


def test_the_page_lists_them():
    """Each row of its table can be read."""
    text = PAGE.read_text(encoding="utf-8").split("## The constants that decide")[1]
    rows = [line for line in text.split("\n## ")[0].splitlines() if line.startswith("| `")]
    assert len(listed()) == len(rows) > 20


@pytest.mark.parametrize(("module", "name", "value"), listed())
def test_a_constant_has_the_value_that_the_page_says(module, name, value):
    """Who changes one says what it means now, and measures what it does."""
    there = import_module(f"zfcal.diagnose.{MODULES.get(module, module)}")
    assert getattr(there, name) == float(value)
