"""What docs/multiaxis.md shows runs, and finds what the page says."""

import contextlib
import io
import re
from pathlib import Path
from typing import Any

import pytest


@pytest.fixture(scope="module")
def shown(repository: Path) -> dict[str, Any]:
    page = (repository / "docs" / "multiaxis.md").read_text(encoding="utf-8")
    names: dict[str, Any] = {}
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        exec("\n".join(re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)), names)
    names["printed"] = printed.getvalue()
    return names


def test_call_of_the_page(shown: dict[str, Any]) -> None:
    truth, found = shown["robot"].parameters(), shown["better"].parameters()
    for name in shown["names"]:
        assert found[name] == pytest.approx(truth[name], rel=0.01), name
    assert "Step 3: all parameters together" in shown["printed"]


def test_load_of_the_page(shown: dict[str, Any]) -> None:
    assert shown["heavy"].load.mass_kg == 80.0
