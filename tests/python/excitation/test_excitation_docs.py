"""What docs/excitation.md shows runs."""

import re
import tomllib
from pathlib import Path

import pytest

from axisight.excitation import read_design


def blocks(repository: Path, language: str) -> list[str]:
    page = (repository / "docs" / "excitation.md").read_text(encoding="utf-8")
    return re.findall(rf"```{language}\n(.*?)```", page, flags=re.DOTALL)


def test_snippets_run(repository: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    exec("\n".join(blocks(repository, "python")), {})
    # The example keeps within its limits.
    assert (tmp_path / "references.csv").exists()


def test_design_is_a_design(repository: Path) -> None:
    (text,) = blocks(repository, "toml")
    read_design(tomllib.loads(text))
