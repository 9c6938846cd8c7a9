"""What is left once the causes are in, and the re-fitted parameters that look suspicious."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from axisight.gap.facts.faults import Finding
from axisight.gap.facts.result import Gap, Remainder, Where
from axisight.gap.facts.settings import Settings
from axisight.gap.facts.wording import percent
from axisight.gap.measure.gap_figures import Stages
from axisight.gap.measure.where import AT_REVERSALS, ErrorLog, band_map, placed, regime_maps
from axisight.gap.verdict.carry_over import above_floor

# A squared gap may rise by so much of what stands above noise through scatter of the logs.
_WORSE = 0.2


def remainder_of(
    stages: Stages, gap: Gap, logs: Sequence[ErrorLog], settings: Settings
) -> Remainder:
    """Return what stands above the floor with the causes in.

    ``logs``: the validation logs with the error that remains and noise alone. Axes that stand above
    the floor of no log, and simulations that broke off, have no place.
    """
    per_axis = np.sqrt(np.maximum(gap.after_per_axis**2 - gap.floor_per_axis**2, 0.0))
    total = float(np.sqrt(max(gap.after**2 - gap.floor**2, 0.0)))
    standing = np.any(above_floor(stages.after, stages) > 0, axis=0)
    whole = all(len(x.noise) == len(x.error) for x in logs)
    if not np.any(standing) or not np.isfinite(total) or not whole:
        return Remainder(total, per_axis)
    bands = band_map(logs, settings.block_s)
    regimes = regime_maps(logs, settings.bandwidth_hz, settings.block_s)
    shares = per_axis**2 / max(float(np.sum(per_axis**2)), 1e-300)
    where = sorted(
        (
            placed(bands, regimes, int(i), float(shares[i]), settings.significance)
            for i in np.flatnonzero(standing)
        ),
        key=lambda w: -w.share,
    )
    regime = where[0].regime
    return Remainder(
        total, per_axis, tuple(where), None if regime is None else regime.partition(":")[0]
    )


def reversals_smeared(
    left: Remainder | None, places: Sequence[Where], cutoff_hz: float | None
) -> tuple[Finding, ...]:
    """Return a finding for axes where what remains lies around reversals, which a low-pass smears.

    Of a torque that jumps there a low-pass of ``cutoff_hz`` leaves a slope of half a period, as wide as
    laws of friction differ; without one (closed loop) there is none. ``places``: of the whole gap, whose
    more logs tell the regime where the remainder's do not.
    """
    if left is None or cutoff_hz is None:
        return ()
    slow = {w.axis for w in (*left.where, *places) if w.regime in AT_REVERSALS}
    return tuple(
        Finding(
            "reversals_smeared",
            "flag",
            f"axis {axis}: what remains lies around reversals, where the low-pass of {cutoff_hz:.3g} Hz "
            f"smears dry friction: try --cutoff-hz {2 * cutoff_hz:.3g}, before something unknown is looked for",
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
        np.mean(stage.per_log(), axis=1) for stage in (stages.given, stages.refitted, stages.floor)
    )
    out = []
    for name, before, after, noise in zip(names, given, refitted, floor, strict=True):
        if after - before > _WORSE * max(before - noise, noise):
            message = (
                f"re-fitted on the estimation logs, the simulator's own parameters raise the gap from "
                f"{percent(float(np.sqrt(before)))} to {percent(float(np.sqrt(after)))}: what they were fitted "
                f"to is no property of the machine; state tighter tolerances."
            )
            out.append(Finding("refit_worse", "flag", message, log=name, field="tolerances"))
    return tuple(out)
