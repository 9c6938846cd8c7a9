"""The installed version of MuJoCo, as far as a number of a model needs a newer one."""

from __future__ import annotations

from functools import cache
from importlib.metadata import PackageNotFoundError, version

OLDEST = (3, 2)
"""The oldest version of MuJoCo that the package works with."""


@cache
def installed() -> tuple[int, ...]:
    """Return the installed version of MuJoCo, (0,) without one."""
    try:
        return tuple(int(part) for part in version("mujoco").split(".")[:2] if part.isdigit())
    except PackageNotFoundError:
        return (0,)


def too_old(since: tuple[int, int], what: str) -> str:
    """Return why MuJoCo does not read ``what``, which it has since a version; empty if it does."""
    if installed() >= since:
        return ""
    needed, got = (".".join(map(str, x)) for x in (since, installed()))
    return f"MuJoCo has {what} since {needed}, installed is {got}"
