"""What docs/models.md shows runs, and prints what the page says."""

import re
from pathlib import Path

import pytest


@pytest.fixture(scope="module")
def blocks(repository: Path) -> list[str]:
    page = (repository / "docs" / "models.md").read_text(encoding="utf-8")
    return re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)


def run(text: str, capsys: pytest.CaptureFixture) -> None:
    """Run a snippet; what it prints is what stands behind its prints, "..." for more digits."""
    exec(text, {"__name__": "snippet"})
    printed = capsys.readouterr().out.splitlines()
    said = re.findall(r"^ *print\(.*\)  # (.*)$", text, flags=re.MULTILINE)
    assert len(printed) == len(said)
    for line, wanted in zip(printed, said, strict=True):
        pattern = ".*".join(re.escape(part) for part in wanted.split(": ")[0].split("..."))
        assert re.fullmatch(pattern, line), (line, wanted)


def test_snippets_run(
    blocks: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert blocks
    for text in blocks:
        run(text, capsys)
