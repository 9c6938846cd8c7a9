"""The gap that is left with the causes in, and re-fits that look suspicious."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from axisight.gap.facts.faults import Finding
from axisight.gap.facts.result import Gap, Remainder, Where
from axisight.gap.facts.settings import Settings
from axisight.gap.facts.wording import percent
from axisight.gap.measure.gap_figures import Stages
from axisight.gap.measure.other_axes import axis_followed
from axisight.gap.measure.where import AT_REVERSALS, ErrorLog, band_map, placed, regime_maps
from axisight.gap.verdict.carry_over import above_floor

# A squared gap may rise by so much of what stands above noise through scatter of the logs.
_WORSE = 0.2


def remainder_of(
    stages: Stages,
    gap: Gap,
    logs: Sequence[ErrorLog],
    settings: Settings,
    quiet: Collection[int] = (),
    as_given: Sequence[ErrorLog] = (),
) -> Remainder:
    """Return what stands above the floor with the causes in.

    ``logs``: the validation logs with the error that remains and noise alone. ``quiet``: axes (from 1) whose
    verdict is *none*. These have no place, nor have axes that stand above the floor of no log, nor
    simulations that broke off. ``as_given``: the same logs with the error of the simulator as given, where it may
    say more than that of the re-fitted one.
    """
    per_axis = np.sqrt(np.maximum(gap.after_per_axis**2 - gap.floor_per_axis**2, 0.0))
    total = float(np.sqrt(max(gap.after**2 - gap.floor**2, 0.0)))
    standing = np.any(above_floor(stages.after, stages) > 0, axis=0)
    standing &= ~np.isin(np.arange(1, len(per_axis) + 1), list(quiet))
    whole = all(len(x.noise) == len(x.error) for x in logs)
    if not np.any(standing) or not np.isfinite(total) or not whole:
        return Remainder(total, per_axis)
    bands = band_map(logs, settings.block_s)
    regimes = regime_maps(logs, settings.bandwidth_hz, settings.block_s)
    shares = per_axis**2 / max(float(np.nansum(per_axis**2)), 1e-300)
    of = "of what remains of the squared gap above the floor"
    where = sorted(
        (
            placed(bands, regimes, int(i), float(shares[i]), settings.significance, of)
            for i in np.flatnonzero(standing)
        ),
        key=lambda w: -w.share,
    )
    followed = _followed(where[0], (logs, as_given), settings)
    return Remainder(total, per_axis, tuple(where), followed)


def _followed(first: Where, errors: Sequence[Sequence[ErrorLog]], settings: Settings) -> str | None:
    """Return what the remainder at its first place varies with: a regime, the speed of another axis, both or none.

    ``errors``: of one simulator or several; the first that follows another axis counts.
    """
    whole = [x for x in errors if x and all(len(y.error) == len(y.noise) for y in x)]
    found = (axis_followed(logs, first.axis - 1, settings) for logs in whole)
    other = next((axis for axis in found if axis is not None), None)
    regime = "" if first.regime is None else first.regime.partition(":")[0]
    speed = "" if other is None else f"the speed of axis {other + 1}"
    return " and ".join(filter(None, [regime, speed])) or None


def reversals_smeared(
    left: Remainder | None, places: Sequence[Where], cutoff_hz: float | None
) -> tuple[Finding, ...]:
    """Return a finding for axes where the remainder lies around reversals, which a low-pass smears.

    A low-pass of ``cutoff_hz`` turns the jump of the torque into a slope of half a period. Laws of friction
    differ over the same width. None without a low-pass (closed loop). ``places``: of the whole gap; it has
    more logs and may tell the regime where the remainder does not.
    """
    if left is None or cutoff_hz is None:
        return ()
    slow = {w.axis for w in (*left.where, *places) if w.regime in AT_REVERSALS}
    return tuple(
        Finding(
            "reversals_smeared",
            "flag",
            f"axis {axis}: the rest of the gap lies around reversals of speed. The low-pass of {cutoff_hz:.3g} Hz "
            f"smears dry friction there. Try --cutoff-hz {2 * cutoff_hz:.3g} before you look for another effect",
            None,
            axis,
            "cutoff_hz",
        )
        for axis in sorted({w.axis for w in left.where} & slow)
    )


def refit_worse(stages: Stages, names: Sequence[str]) -> tuple[Finding, ...]:
    """Return a finding for each validation log whose gap the re-fit alone raises well above noise.

    ``names``: of the logs.
    """
    given, refitted, floor = (
        stage.by_log() for stage in (stages.given, stages.refitted, stages.floor)
    )
    out = []
    for name, before, after, noise in zip(names, given, refitted, floor, strict=True):
        if after - before > _WORSE * max(before - noise, noise):
            message = (
                f"the re-fit on the estimation logs raises the gap of this log from "
                f"{percent(float(np.sqrt(before)))} to {percent(float(np.sqrt(after)))}. The parameters were fitted "
                f"to something that is no property of the machine. State tighter tolerances"
            )
            out.append(Finding("refit_worse", "flag", message, log=name, field="tolerances"))
    return tuple(out)
