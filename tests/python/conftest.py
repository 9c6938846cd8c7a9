"""Fixtures that find the shared data and practice cases, or say plainly what is missing."""

import os
import sys
from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("axisight", deadline=None, derandomize=True)
settings.load_profile("axisight")

_REPOSITORY = Path(__file__).resolve().parents[2]

# Tests in one folder use helpers from another, so every folder must be importable.
_HERE = Path(__file__).parent
sys.path.extend(sorted({str(test.parent) for test in _HERE.rglob("test_*.py")} - {str(_HERE)}))


def long_tests() -> list[str]:
    """Return the tests that the gate leaves to `make test-long`, as `long_tests.txt` lists them."""
    lines = (_HERE / "long_tests.txt").read_text("utf-8").splitlines()
    return [line for line in lines if line and not line.startswith("#")]


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark long tests: `-m "not long"` leaves them out."""
    listed = set(long_tests())
    for item in items:
        if {item.nodeid, item.nodeid.partition("[")[0]} & listed:
            item.add_marker(pytest.mark.long)


def _data_folder() -> Path | None:
    named = os.environ.get("AXISIGHT_DATA")
    folder = Path(named) if named else _REPOSITORY.parent / "shared" / "data"
    return folder if folder.is_dir() else None


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Return the folder of real measured data; without it the test is skipped, and counted."""
    folder = _data_folder()
    if folder is None:
        pytest.skip("real data not found: set AXISIGHT_DATA")
    return folder


@pytest.fixture(scope="session")
def shared(shared_data: Path) -> Path:
    """Return the folder above the real data: practice cases, robot, specifications."""
    return shared_data.parent


@pytest.fixture(scope="session")
def repository() -> Path:
    """Return the root of this repository."""
    return _REPOSITORY
