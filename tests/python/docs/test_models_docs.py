"""What docs/models.md, docs/mujoco.md and docs/usd.md show runs, and prints what the pages say."""

import re
from pathlib import Path

import pytest

from axisight.robot_import.dh_rows import COLUMNS, OPTIONAL
from key_tables import same, told


@pytest.fixture(scope="module")
def page(repository: Path) -> str:
    return (repository / "docs" / "models.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def blocks(repository: Path, page: str) -> list[str]:
    more = [repository / "docs" / f"{name}.md" for name in ("mujoco", "usd")]
    text = page + "".join(other.read_text(encoding="utf-8") for other in more)
    return re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL)


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


def test_every_column_of_a_table_of_joints_is_told(page: str) -> None:
    section = page.split("\n## Tables of Denavit and Hartenberg\n")[1]
    defaults = {name: f"`{value}`" for name, value in OPTIONAL.items()}
    known = {name: defaults.get(name, "needed") for name in COLUMNS}
    same(told(section.split("\n## ", maxsplit=1)[0]), known)
