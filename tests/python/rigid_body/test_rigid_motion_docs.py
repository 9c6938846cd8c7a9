"""What docs/rigid_motion.md shows of motions, bodies that exist and trajectories runs."""

import re
from pathlib import Path
from typing import Any

import pytest


@pytest.fixture(scope="module")
def shown(repository: Path) -> dict[str, Any]:
    page = (repository / "docs" / "rigid_motion.md").read_text(encoding="utf-8")
    names: dict[str, Any] = {}
    exec("\n".join(re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)), names)
    return names


def test_motion_is_as_printed(shown: dict[str, Any], repository: Path) -> None:
    page = (repository / "docs" / "rigid_motion.md").read_text(encoding="utf-8")
    assert str(shown["motion"]) in page


def test_bodies_and_trajectory(shown: dict[str, Any]) -> None:
    assert shown["possible"].status in ("already_consistent", "solved")
    assert shown["found"].status in ("converged", "max_iterations")
    assert shown["found"].condition_after < shown["found"].condition_before
    references = shown["references"]
    assert references.design["condition"] == shown["found"].condition_after
    # Joint limit over gear ratio.
    assert references.peak.max() <= 1.5 * 224.3 * 1.001
