"""How right causes are that were said with a probability, and whether that carries over to other engines."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.blind.score import Judged

Array = NDArray[np.float64]

_BINS = 10
# The engine on which a temperature is fitted, to be judged on the others.
_FITTED_ON = "mujoco"
# Verdicts state probabilities to so much: none is surer.
_SUREST = 1e-3
# Factors on log-odds that are looked at.
_COLDEST, _HOTTEST = 0.2, 5.0
# Causes, below which nothing is fitted.
_FEW = 20


def calibration_bins(judged: Sequence[Judged]) -> list[dict[str, float]]:
    """Return by probability said: causes named (``count``), mean said and share right; empty bins left out."""
    return _bins(*_said(judged))


def calibration_error(judged: Sequence[Judged]) -> float:
    """Return the expected calibration error of the causes named (Naeini 2015), ten bins; NaN without."""
    return _error(*_said(judged))


def carried_over(judged: Sequence[Judged]) -> dict[str, Any] | None:
    """Return a temperature fitted on one engine, and what it does to probabilities on the others.

    Log-odds are divided by it (Guo et al. 2017); one that is above 1 says that causes were named too
    surely. Losses are mean logarithmic ones [nat]. None where an engine has too few causes.
    """
    own, right = _said([j for j in judged if j.setting["engine"] == _FITTED_ON])
    others = sorted({j.setting["engine"] for j in judged} - {_FITTED_ON})
    if len(own) < _FEW or not others:
        return None
    found = scipy.optimize.minimize_scalar(
        lambda log_t: _log_loss(_scaled(own, np.exp(log_t)), right),
        bounds=(np.log(_COLDEST), np.log(_HOTTEST)),
        method="bounded",
    )
    temperature = float(np.exp(found.x))
    return {
        "fitted_on": _FITTED_ON,
        "causes": len(own),
        "temperature": temperature,
        "judged_on": {name: _judged_with(judged, name, temperature) for name in others},
    }


def _judged_with(judged: Sequence[Judged], engine: str, temperature: float) -> dict[str, float]:
    said, right = _said([j for j in judged if j.setting["engine"] == engine])
    scaled = _scaled(said, temperature)
    return {
        "causes": len(said),
        "error": _error(said, right),
        "error_scaled": _error(scaled, right),
        "log_loss": _log_loss(said, right),
        "log_loss_scaled": _log_loss(scaled, right),
    }


def _said(judged: Sequence[Judged]) -> tuple[Array, Array]:
    """Return of all causes named what probability was said, and whether they are true (1 or 0)."""
    pairs = [
        (p, float(label in j.truth))
        for j in judged
        for p, label in zip(j.probabilities, j.named, strict=True)
    ]
    said, right = np.array(pairs, dtype=np.float64).reshape(-1, 2).T
    return said, right


def _bins(said: Array, right: Array) -> list[dict[str, float]]:
    bins = np.minimum((said * _BINS).astype(int), _BINS - 1)
    return [
        {
            "from": float(b / _BINS),
            "to": float((b + 1) / _BINS),
            "count": int(np.sum(bins == b)),
            "probability": float(said[bins == b].mean()),
            "right": float(right[bins == b].mean()),
        }
        for b in np.unique(bins)
    ]


def _error(said: Array, right: Array) -> float:
    bins = _bins(said, right)
    off = (b["count"] * abs(b["probability"] - b["right"]) for b in bins)
    return sum(off) / len(said) if len(said) else float("nan")


def _scaled(said: Array, temperature: float) -> Array:
    sure = np.clip(said, _SUREST, 1 - _SUREST)
    return np.asarray(scipy.special.expit(scipy.special.logit(sure) / temperature))


def _log_loss(said: Array, right: Array) -> float:
    sure = np.clip(said, _SUREST, 1 - _SUREST)
    return float(-np.mean(np.where(right > 0, np.log(sure), np.log1p(-sure))))
