"""Calibration of the named causes: whether a probability says how often a cause is right, on each engine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.blind.score import Judged
from axisight.effects import effect_info

Array = NDArray[np.float64]

_BINS = 10
# The temperature is fitted on this engine and judged on the others.
_FITTED_ON = "mujoco"
# Verdicts round probabilities to this: no cause is closer to 0 or 1.
_SUREST = 1e-3
# Range of the temperature.
_COLDEST, _HOTTEST = 0.2, 5.0
# Fewer causes than this are too few for a fit.
_FEW = 20
# Prior of a family, in log-odds: standard deviation and bound.
_PRIOR, _LARGEST = 1.0, 5.0


def calibration_bins(judged: Sequence[Judged]) -> list[dict[str, float]]:
    """Return per bin of probability the named causes (``count``), mean probability and share right."""
    return _bins(*_said(judged))


def calibration_error(judged: Sequence[Judged]) -> float:
    """Return the expected calibration error of named causes (Naeini 2015), ten bins; NaN without causes."""
    return _error(*_said(judged))


def carried_over(judged: Sequence[Judged]) -> dict[str, Any] | None:
    """Return a temperature and priors by family, fitted on one engine, and their losses on the others.

    The temperature divides log-odds (Guo et al. 2017); above 1 it says that verdicts were overconfident. The
    prior of a family is the remaining error of its log-odds, normal with a standard deviation of 1. Losses
    are mean logarithmic losses [nat]. None if the fitted engine has too few causes or no other engine has
    cases.
    """
    fitted_on = [j for j in judged if j.setting["engine"] == _FITTED_ON]
    own, right = _said(fitted_on)
    others = sorted({j.setting["engine"] for j in judged} - {_FITTED_ON})
    if len(own) < _FEW or not others:
        return None
    found = scipy.optimize.minimize_scalar(
        lambda log_t: _log_loss(_scaled(own, np.exp(log_t)), right),
        bounds=(np.log(_COLDEST), np.log(_HOTTEST)),
        method="bounded",
    )
    temperature = float(np.exp(found.x))
    families = _families(fitted_on)
    priors = {
        family: _prior(own[families == family], right[families == family], temperature)
        for family in np.unique(families).tolist()
    }
    return {
        "fitted_on": _FITTED_ON,
        "causes": len(own),
        "temperature": temperature,
        "priors": priors,
        "judged_on": {name: _judged_with(judged, name, temperature, priors) for name in others},
    }


def _prior(said: Array, right: Array, temperature: float) -> float:
    """Return the error of log-odds that remains after a temperature."""

    def loss(prior: float) -> float:
        return (
            len(said) * _log_loss(_scaled(said, temperature, prior), right)
            + 0.5 * (prior / _PRIOR) ** 2
        )

    found = scipy.optimize.minimize_scalar(loss, bounds=(-_LARGEST, _LARGEST), method="bounded")
    return float(found.x)


def _judged_with(
    judged: Sequence[Judged], engine: str, temperature: float, priors: Mapping[str, float]
) -> dict[str, float]:
    others = [j for j in judged if j.setting["engine"] == engine]
    said, right = _said(others)
    scaled = _scaled(said, temperature)
    own = np.array([priors.get(family, 0.0) for family in _families(others)])
    moved = _scaled(said, temperature, own)
    return {
        "causes": len(said),
        "error": _error(said, right),
        "error_scaled": _error(scaled, right),
        "log_loss": _log_loss(said, right),
        "log_loss_scaled": _log_loss(scaled, right),
        "error_priors": _error(moved, right),
        "log_loss_priors": _log_loss(moved, right),
    }


def _said(judged: Sequence[Judged]) -> tuple[Array, Array]:
    """Return the stated probability of every named cause that has one, and whether the cause is true (1 or 0)."""
    pairs = [
        (p, float(label in j.truth))
        for j in judged
        for p, label in zip(j.probabilities, j.named, strict=True)
        if np.isfinite(p)
    ]
    said, right = np.array(pairs, dtype=np.float64).reshape(-1, 2).T
    return said, right


def _families(judged: Sequence[Judged]) -> NDArray[np.str_]:
    """Return the family of every named cause, in the order of `_said`."""
    effects = [
        label.split("@")[0]
        for j in judged
        for p, label in zip(j.probabilities, j.named, strict=True)
        if np.isfinite(p)
    ]
    return np.array([effect_info(name).family for name in effects], dtype=np.str_)


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


def _scaled(said: Array, temperature: float, prior: Array | float = 0.0) -> Array:
    sure = np.clip(said, _SUREST, 1 - _SUREST)
    return np.asarray(scipy.special.expit(scipy.special.logit(sure) / temperature + prior))


def _log_loss(said: Array, right: Array) -> float:
    sure = np.clip(said, _SUREST, 1 - _SUREST)
    return float(-np.mean(np.where(right > 0, np.log(sure), np.log1p(-sure))))
