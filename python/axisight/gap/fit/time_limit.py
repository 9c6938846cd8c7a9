"""A limit on the time of a search, checked before every fit and every evaluation of a model."""

from __future__ import annotations

import math
import time

from axisight.errors import InputError


class TimeUp(Exception):
    """The time limit is reached: no further fit begins. A search catches it and keeps what it has."""


class TimeLimit:
    """A limit of ``limit_s`` seconds from when it is made; infinity is no limit.

    Raises InputError for a limit that is not a positive number.
    """

    def __init__(self, limit_s: float) -> None:
        if isinstance(limit_s, bool) or not isinstance(limit_s, int | float) or not limit_s > 0:
            raise InputError(
                f"time_limit_s: expected more than 0 s, infinity for no limit, got {limit_s!r}"
            )
        self.limit_s = float(limit_s)
        self._end_s = _now_s() + self.limit_s

    def check(self) -> None:
        """Raise TimeUp once the limit is reached."""
        if _now_s() > self._end_s:
            raise TimeUp

    @staticmethod
    def none() -> TimeLimit:
        """Return no limit."""
        return TimeLimit(math.inf)


_now_s = time.monotonic
