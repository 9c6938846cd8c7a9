"""Prior densities of a parameter over machines; each integrates to 1 within the bounds."""

from __future__ import annotations

import math

_ROOT = math.sqrt(2.0)


def half_normal(value: float, neutral: float, typical: float, bounds: tuple[float, float]) -> float:
    """Return the log-density of a normal deviation from ``neutral`` with standard deviation ``typical``."""
    low, high = ((b - neutral) / typical for b in bounds)
    return _standard((value - neutral) / typical, low, high) - math.log(typical)


def log_normal(value: float, typical: float, spread: float, bounds: tuple[float, float]) -> float:
    """Return the log-density of a value whose logarithm is normal about that of ``typical``.

    ``spread`` is the standard deviation of the logarithm [1]. Minus infinity for values of zero and below.
    """
    if value <= 0:
        return -math.inf
    low, high = (math.log(b / typical) / spread if b > 0 else -math.inf for b in bounds)
    return _standard(math.log(value / typical) / spread, low, high) - math.log(spread * value)


def _standard(z: float, low: float, high: float) -> float:
    """Return the log-density of a standard normal variable truncated to ``low`` to ``high``."""
    within = 0.5 * (math.erf(high / _ROOT) - math.erf(low / _ROOT))
    return -0.5 * z**2 - 0.5 * math.log(2 * math.pi) - math.log(within)
