"""The programs of README, docs/tutorial.md, docs/python.md and the docstrings are run as they stand."""

import doctest
import importlib
import re
from pathlib import Path

import pytest

import snaprod

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("name", ["README.md", "docs/tutorial.md", "docs/python.md"])
def test_the_programs_run(name, tmp_path, monkeypatch):
    """Catches documentation that no longer runs: all blocks of a document, one after the other."""
    blocks = re.findall(r"^```python\n(.*?)^```", (ROOT / name).read_text(encoding="utf-8"), re.M | re.S)
    assert blocks
    (tmp_path / "scenes").symlink_to(ROOT / "scenes")
    monkeypatch.chdir(tmp_path)
    space: dict[str, object] = {"__name__": "document"}
    for block in blocks:
        exec(compile(block, name, "exec"), space)


def test_the_examples_of_docstrings_hold():
    """Catches a docstring whose numbers are not those that come out."""
    for name in ("snaprod", "snaprod._fit", "snaprod._results", "snaprod._simulation", "snaprod._sweep"):
        found = doctest.testmod(importlib.import_module(name), extraglobs={"snaprod": snaprod})
        assert found.attempted and not found.failed, name
