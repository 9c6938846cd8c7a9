"""Claims that hold the values of Tables 9.1 to 9.3 against those of the thesis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from scipy import stats

from axisight_thesis.item import Claim

Values = Mapping[str, Sequence[float]]
"""Parameter values of models m0 to m3 by name."""
Changes = Mapping[str, Sequence[Sequence[float]]]
"""Changes of fit by parameter: (+20 %, -20 %) for each data set."""

_RIGID = ("J_m", "J_a", "F_v", "F_c")
_FLEXIBLE = ("k1", "k3", "d")
# Changes of fit [points] that count as noticeable; the thesis gives two decimals.
_NOTICEABLE = 1.0


def parameter_claims(
    here: Values, thesis: Values, one_arm: Mapping[str, float]
) -> tuple[Claim, ...]:
    """Return the claims on Table 9.1; ``one_arm`` are the values if the arm is one mass.

    The tolerance is the range of the thesis's own estimates m1 to m3: what a change of data does.
    """
    statements = (
        ("rigid", _RIGID, "inertias and friction"),
        ("flexible", _FLEXIBLE, "stiffness and damping"),
    )
    claims = []
    for name, parameters, what in statements:
        inside, texts = [], []
        for p in parameters:
            ours, theirs = np.asarray(here[p][1:]), np.asarray(thesis[p][1:])
            apart, allowed = abs(ours.mean() - theirs.mean()), np.ptp(theirs)
            inside.append(apart <= allowed)
            texts.append(
                f"{p} {ours.mean():.3g} and {theirs.mean():.3g}, apart {apart:.2g} of {allowed:.2g}"
            )
        claims.append(
            Claim(
                f"table-9.1-{name}",
                "9.5.3",
                f"Table 9.1, {what}: the means of m1 to m3 differ from those of the thesis by no more "
                "than its range over m1 to m3.",
                all(inside),
                f"here and in the thesis: {'; '.join(texts)}. If the arm is one mass: "
                + ", ".join(f"{p} {one_arm[p]:.3g}" for p in parameters),
            )
        )
    return tuple(claims)


def fit_claims(
    here: xr.DataArray, thesis: Mapping[int, Sequence[float]], three_masses: Sequence[float]
) -> tuple[Claim, ...]:
    """Return the claims on Table 9.2; ``three_masses`` are the fits of a model of three masses [%]."""
    ours, theirs = (
        here.transpose("data_set", "estimated_on").values,
        np.array(list(thesis.values())),
    )
    spread, allowed = (np.ptp(x[:, 1:], axis=1) for x in (ours, theirs))
    left, left_theirs, left_three = (
        100 - x for x in (ours[:, 3], theirs[:, 3], np.asarray(three_masses))
    )
    return (
        Claim(
            "table-9.2-set-1",
            "9.5.3",
            "Table 9.2: every model fits set 1 best.",
            bool((ours.argmax(axis=0) == 0).all()),
            f"margin over the next set {', '.join(f'{m:.1f}' for m in ours[0] - ours[1:].max(axis=0))} points",
        ),
        Claim(
            "table-9.2-models",
            "9.5.3",
            "Table 9.2: on each set m1 to m3 fit alike, within the largest range of the thesis.",
            bool(spread.max() <= allowed.max()),
            f"range over m1 to m3 {', '.join(f'{s:.2f}' for s in spread)} points, in the thesis "
            f"{', '.join(f'{s:.2f}' for s in allowed)}",
        ),
        Claim(
            "table-9.2-residual",
            "9.5.3",
            "Table 9.2: m3 leaves as large a residual as in the thesis, within a factor 2.",
            bool((np.abs(np.log(left / left_theirs)) <= np.log(2)).all()),
            f"residual of m3 {_percent(left)}, in the thesis {_percent(left_theirs)}. With three masses "
            f"{_percent(left_three)} remain, which is ripple and noise: the rest of the thesis's residual "
            "is not in this machine",
        ),
    )


def change_claims(here: xr.DataArray, thesis: Changes) -> tuple[Claim, ...]:
    """Return the claims on Table 9.3; ``here`` has dims (parameter, change, data_set) [points]."""
    names = list(thesis)
    ours = here.sel(parameter=names).transpose("parameter", "data_set", "change").values
    theirs = np.array([thesis[n] for n in names])
    rank = stats.spearmanr(ours.ravel(), theirs.ravel())
    large = np.abs(theirs) > _NOTICEABLE
    opposite = large & (np.sign(ours) != np.sign(theirs))
    listed = ", ".join(
        f"{names[i]} on set {k + 1} {theirs[i, k, s]:+.2f} (here {ours[i, k, s]:+.2f})"
        for i, k, s in np.argwhere(opposite)
    )
    costliest, costliest_theirs = (
        [names[int(np.abs(x[:, k]).max(axis=1).argmax())] for k in range(3)] for x in (ours, theirs)
    )
    difference = np.abs(ours - theirs)
    return (
        Claim(
            "table-9.3-order",
            "9.5.3",
            "Table 9.3: the changes of fit are ordered as in the thesis.",
            bool(rank.statistic > 0 and rank.pvalue < 0.05),
            f"rank correlation {rank.statistic:.2f} over {ours.size} entries (p = {rank.pvalue:.0e}); "
            f"difference {np.median(difference):.1f} points in the median, {difference.max():.0f} at most",
        ),
        Claim(
            "table-9.3-signs",
            "9.5.3",
            f"Table 9.3: changes of more than {_NOTICEABLE:g} point have the sign of the thesis.",
            not opposite.any(),
            f"{int(opposite.sum())} of {int(large.sum())} have the other sign: {listed or 'none'}. A fit that "
            "rises when a parameter of m3 changes says that the sets disagree about it. Here they agree",
        ),
        Claim(
            "table-9.3-largest",
            "9.5.3",
            "Table 9.3: on each set, the same parameter costs most as in the thesis.",
            costliest == costliest_theirs,
            f"on sets 1, 2, 3 {', '.join(costliest)}; in the thesis {', '.join(costliest_theirs)}",
        ),
    )


def _percent(values: np.ndarray) -> str:
    return ", ".join(f"{v:.1f}" for v in values) + " %"
