"""Assessment of an information: standard deviations, and combinations that are not determined."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import linalg
from scipy.sparse import csgraph

from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.identifiability.information import Array, Information
from axisight.statistics.least_squares import unit_columns

Form = Literal["auto", "power", "linear"]

NUMERICAL_RANK = 1e-11
"""Singular values of the weighted Jacobian below this share of the largest are rounding of the
derivatives, for columns of unit length."""
POOR = 0.5
"""Relative standard deviation above which a combination is poorly identifiable."""
TILT = 0.05
"""Smallest share of a parameter, relative to its scale, in a poorly identifiable combination."""
SIMPLE_POWERS = (0.5, 1.0, 2.0, 3.0)


@summarized
@dataclass(frozen=True)
class Combination:
    """Parameters that the data do not determine alone, and combinations that they do.

    ``kind`` is ``unidentifiable`` (no information) or ``poor`` (standard deviation above the limit).
    ``parameters`` are those not known alone. ``seen`` are the combinations that are known, as text,
    with relative standard deviations ``seen_std``. ``relative_std`` is that of the worst direction,
    infinite if unidentifiable. ``directions`` (n_lost, n) are changes that hardly show, in units of
    the scales.
    """

    kind: Literal["unidentifiable", "poor"]
    parameters: tuple[str, ...]
    seen: tuple[str, ...]
    seen_std: tuple[float, ...]
    relative_std: float
    directions: Array = field(repr=False)

    def __str__(self) -> str:
        """Return the combination as a sentence."""
        known = " and ".join(
            f"{text} (to {percent(std)})"
            for text, std in zip(self.seen, self.seen_std, strict=True)
        )
        several = ", ".join(self.parameters)
        if self.kind == "unidentifiable":
            if not self.seen:
                return f"{several}: not seen at all"
            return (
                f"only {known} {'is' if len(self.seen) == 1 else 'are'} seen, not each of {several}"
            )
        worst = percent(self.relative_std)
        if not self.seen:
            return f"{several}: known to {worst} only"
        return f"only {known} {'is' if len(self.seen) == 1 else 'are'} known well; {several} trade off, to {worst}"


@summarized
@dataclass(frozen=True)
class Identifiability:
    """Identifiability of parameters from an experiment.

    ``rank`` is that of the information, at most ``len(names)``. ``condition`` is that of its root for
    scaled parameters, infinite without full rank. ``relative_std`` (n,) are the least standard
    deviations of Cramer and Rao relative to the scales, infinite for parameters without information;
    ``correlation`` (n, n) is NaN for these. ``combinations`` are those that are not known to ``limit``.
    ``clusters`` are groups of parameters correlated beyond the correlation limit.
    """

    names: tuple[str, ...]
    scales: Array
    rank: int
    condition: float
    relative_std: Array
    correlation: Array = field(repr=False)
    combinations: tuple[Combination, ...]
    clusters: tuple[tuple[str, ...], ...]
    experiment: str
    limit: float

    @property
    def identifiable(self) -> bool:
        """Whether every parameter is known to ``limit``."""
        return not self.combinations

    @property
    def std(self) -> Array:
        """Least standard deviations in the units of the parameters."""
        return np.asarray(self.relative_std * self.scales)

    def words(self) -> tuple[str, ...]:
        """Return a sentence for each combination that is not known, worst first."""
        return tuple(str(c) for c in self.combinations)

    def to_xarray(self) -> xr.Dataset:
        """Return standard deviations and correlations over ``parameter``."""
        return xr.Dataset(
            {
                "scale": ("parameter", self.scales),
                "relative_std": ("parameter", self.relative_std),
                "std": ("parameter", self.std),
                "correlation": (("parameter", "other"), self.correlation),
            },
            coords={"parameter": list(self.names), "other": list(self.names)},
            attrs={"rank": self.rank, "condition": self.condition, "experiment": self.experiment},
        )


def identifiability(
    experiment: Information,
    *,
    limit: float = POOR,
    form: Form = "auto",
    correlation_limit: float = 0.95,
) -> Identifiability:
    """Return which parameters an experiment determines, and combinations that it does not determine.

    experiment
        Information of the experiment, or the sum over several experiments.
    limit
        Relative standard deviation above which a combination is poorly identifiable.
    form
        Form of combinations: ``"power"`` for products and ratios; ``"linear"`` for sums, for models
        linear in the parameters; ``"auto"`` for powers if they are simple. Both forms agree to first
        order.
    correlation_limit
        Parameters with correlations beyond this form one cluster.

    Raises InputError for misuse.
    """
    if not (np.isfinite(limit) and limit > 0):
        raise InputError(f"limit: expected a positive number, got {limit}")
    if form not in ("auto", "power", "linear"):
        raise InputError(f"form: expected 'auto', 'power' or 'linear', got {form!r}")
    if not 0 < correlation_limit <= 1:
        raise InputError(f"correlation_limit: expected above 0 up to 1, got {correlation_limit}")
    names, n = experiment.names, len(experiment.names)
    s, v, rank = decomposed(experiment)
    lost = np.arange(n) >= rank
    with np.errstate(divide="ignore"):
        spread = np.where(lost, np.inf, 1 / np.where(s > 0, s, np.nan))
    finite = np.where(lost, 0.0, np.nan_to_num(spread, posinf=0.0))
    covariance = (v * finite**2) @ v.T
    relative = np.sqrt(np.diag(covariance))
    unseen = np.linalg.norm(v[:, lost], axis=1) > 1e-6
    with np.errstate(invalid="ignore", divide="ignore"):
        correlation = covariance / np.outer(relative, relative)
    relative[unseen] = np.inf
    correlation[unseen] = np.nan
    correlation[:, unseen] = np.nan
    found = _combinations(experiment, v, spread, limit, form)
    return Identifiability(
        names=names,
        scales=experiment.scales,
        rank=rank,
        condition=float(s[0] / s[-1]) if rank == n else np.inf,
        relative_std=relative,
        correlation=correlation,
        combinations=tuple(sorted(found, key=lambda c: -c.relative_std)),
        clusters=_clusters(names, correlation, correlation_limit),
        experiment=experiment.name,
        limit=limit,
    )


def decomposed(experiment: Information) -> tuple[Array, Array, int]:
    """Return singular values and right vectors of the scaled root, and its rank."""
    n = len(experiment.names)
    root = experiment.root
    unit, size = unit_columns(root)
    values = np.linalg.svd(unit, compute_uv=False) if len(root) else np.zeros(0)
    rank = int(np.sum(values > NUMERICAL_RANK * values[0])) if values.size and values[0] > 0 else 0
    scaled = root * experiment.scales
    padded = np.vstack([scaled, np.zeros((max(n - len(scaled), 0), n))])
    # The exact null space comes from unit columns, so that scales do not decide what is rounding.
    _, _, unit_vt = np.linalg.svd(np.vstack([unit, np.zeros((max(n - len(unit), 0), n))]))
    null = unit_vt[rank:].T / np.where(root.any(axis=0), size * experiment.scales, 1.0)[:, None]
    q, _ = np.linalg.qr(null, mode="complete") if rank < n else (np.eye(n), None)
    known = q[:, n - rank :]
    _, s, vt = np.linalg.svd(padded @ known, full_matrices=False)
    return (
        np.concatenate([s[:rank], np.zeros(n - rank)]),
        np.hstack([known @ vt[:rank].T, q[:, : n - rank]]),
        rank,
    )


def _combinations(
    experiment: Information, v: Array, spread: Array, limit: float, form: Form
) -> list[Combination]:
    """Return the groups of parameters that are not known alone, with the combinations that are."""
    chosen, lost = spread > limit, np.isinf(spread)
    if not chosen.any():
        return []
    names, space = experiment.names, v[:, chosen]
    n, k = space.shape
    # Of parameters with equal shares, the later one is expressed by the earlier ones.
    later = 1 + 0.1 * np.arange(n) / n
    _, _, pivots = linalg.qr(space.T * later, mode="economic", pivoting=True)
    free = np.sort(pivots[:k])
    shares = space @ np.linalg.inv(space[free])
    # An exact null space has no small shares except rounding, but poor directions tilt a little.
    shares[np.abs(shares) < (1e-6 if lost[chosen].all() else TILT)] = 0.0
    linked = np.zeros((n, n))
    linked[:, free] = np.abs(shares)
    _, group = csgraph.connected_components(linked, directed=False)
    out = []
    for label in np.unique(group[free]):
        members = np.flatnonzero(group == label)
        own = np.flatnonzero(group[free] == label)
        seen, stds = [], []
        for i in (int(i) for i in members if i not in free):
            powers = shares[i, own]
            used = np.flatnonzero(powers)
            seen.append(
                _expression(names, experiment.scales, i, free[own][used], powers[used], form)
            )
            contrast = np.zeros(n)
            contrast[i] = 1.0
            contrast[free[own]] = -powers
            stds.append(float(np.linalg.norm(v[:, ~chosen].T @ contrast * spread[~chosen])))
        unseen = np.linalg.norm(v[np.ix_(members, lost)], axis=0) > 0.5
        # The worst direction of these parameters.
        poor = chosen & ~lost
        worst = float(np.linalg.norm(v[np.ix_(members, poor)] * spread[poor], ord=2))
        out.append(
            Combination(
                "unidentifiable" if unseen.any() else "poor",
                tuple(names[int(i)] for i in members),
                tuple(seen),
                tuple(stds),
                np.inf if unseen.any() else worst,
                shares[:, own].T,
            )
        )
    return out


def _expression(
    names: Sequence[str], scales: Array, i: int, others: NDArray[np.intp], powers: Array, form: Form
) -> str:
    """Return the combination that stays constant: theta_i minus shares of others, or over their powers."""
    simple = all(min(abs(abs(p) - x) for x in SIMPLE_POWERS) < 0.02 for p in powers)
    if form == "power" or (form == "auto" and simple):
        top: list[str] = [names[i]]
        bottom: list[str] = []
        for j, power in zip(others, powers, strict=True):
            size = _power(abs(power))
            (bottom if power > 0 else top).append(f"{names[j]}{size}")
        text = " · ".join(top)
        if not bottom:
            return text
        return f"{text} / {bottom[0] if len(bottom) == 1 else '(' + ' · '.join(bottom) + ')'}"
    text = names[i]
    for j, power in zip(others, powers, strict=True):
        share = -power * scales[i] / scales[j]
        factor = "" if abs(abs(share) - 1) < 5e-4 else f"{abs(share):.4g} "
        text += f" {'+' if share > 0 else '-'} {factor}{names[j]}"
    return text


def _power(power: float) -> str:
    return "" if abs(power - 1) < 0.02 else f"^{power:.2g}"


def percent(share: float) -> str:
    """Return a share as text in per cent."""
    if not np.isfinite(share):
        return "nothing"
    return f"{100 * share:.2g} %" if share < 10 else "worse than 1000 %"


def _clusters(
    names: Sequence[str], correlation: Array, limit: float
) -> tuple[tuple[str, ...], ...]:
    linked = np.nan_to_num(np.abs(correlation)) >= limit
    _, group = csgraph.connected_components(linked, directed=False)
    sets = [np.flatnonzero(group == label) for label in np.unique(group)]
    return tuple(tuple(names[int(i)] for i in members) for members in sets if len(members) > 1)
