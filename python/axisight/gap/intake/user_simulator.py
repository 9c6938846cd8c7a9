"""Compares the model with the user's own simulator, and makes the gap that of this simulator."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisight.errors import InputError
from axisight.gap.facts.compared_quantity import Compared, torque_of
from axisight.gap.facts.faults import Finding
from axisight.gap.facts.result import Reproduction
from axisight.gap.facts.settings import Settings
from axisight.gap.facts.simulator_variant import AS_GIVEN
from axisight.gap.facts.wording import percent
from axisight.gap.measure.where import ErrorLog, band_map, findings, regime_maps
from axisight.gap.simulator.closed_loop_runs import simulated_positions
from axisight.gap.views.view import View
from axisight.logs import Log

Array = NDArray[np.float64]

# Difference of model and simulator that does not matter, as a share of the simulator's gap: 10 % of the squared
# gap.
_HARMLESS = 0.1**0.5
# Largest relative difference between equal references or sample times, for rounding.
_SAME = 1e-3


def differs(found: Reproduction) -> NDArray[np.int64]:
    """Return the axes (from 0) where the difference matters and exceeds noise."""
    places = [w.axis - 1 for w in found.where]
    large = found.of_gap > _HARMLESS
    return np.flatnonzero(large & np.isin(np.arange(len(large)), places))


def said(found: Reproduction, compared: Compared = "torques") -> str:
    """Return a sentence about how well the model reproduces the user's simulator."""
    axes = ", ".join(f"axis {i + 1}: {percent(x)}" for i, x in enumerate(found.per_axis.tolist()))
    whose = (
        "The gap is that of your simulator: the difference is subtracted from the logs"
        if found.taken_off
        else "The gap is that of the model, because your simulator moves differently from the machine"
    )
    return f"The model differs from your simulator by {axes} of its {torque_of(compared)}. {whose}."


def noted(found: Reproduction) -> list[Finding]:
    """Return a finding for each axis where the difference matters."""
    return [_finding(found, int(axis)) for axis in differs(found)]


def _finding(found: Reproduction, axis: int) -> Finding:
    place = next(w for w in found.where if w.axis == axis + 1)
    band = (
        "" if place.band_hz is None else f", mostly at {place.band_hz[0]:g}-{place.band_hz[1]:g} Hz"
    )
    regime = "" if place.regime is None else f", {place.regime}"
    message = (
        f"expected a model that reproduces your simulator, got one that differs from it on axis "
        f"{axis + 1} by {percent(float(found.of_gap[axis]))} of the gap{band}{regime}. Diagnose the simulated logs "
        "themselves: the causes are what the model lacks"
    )
    return Finding("simulator_differs", "flag", message, None, axis + 1, "simulated")


def paired(logs: Sequence[Log], simulated: Sequence[Log]) -> list[Log]:
    """Return the logs of the user's simulator, with references, start and run-up of the measured logs.

    Raises InputError if they are not runs of the same motions: if number of logs or axes, rate, length or
    references differ.
    """
    if len(simulated) != len(logs):
        raise InputError(
            f"simulated: expected one for each of {len(logs)} logs, estimation logs first, "
            f"got {len(simulated)}"
        )
    return [_paired(log, own) for log, own in zip(logs, simulated, strict=True)]


def _paired(log: Log, own: Log) -> Log:
    field = f"simulated log {own.name!r}"
    if own.position_rad.shape != log.position_rad.shape:
        raise InputError(
            f"{field}: expected {log.n_samples} samples of {log.n_axes} axes as in log {log.name!r}, "
            f"got {own.n_samples} of {own.n_axes}"
        )
    if abs(own.sample_time_s / log.sample_time_s - 1) > _SAME:
        raise InputError(
            f"{field}: expected a sample time of {log.sample_time_s:g} s as in log {log.name!r}, "
            f"got {own.sample_time_s:g} s"
        )
    given: dict[str, Any] = {}
    for name in ("velocity_ref_rad_s", "position_ref_rad"):
        real, mine = getattr(log, name), getattr(own, name)
        if real is not None and mine is not None:
            off = np.abs(real - mine).max(axis=0)
            axis = int(np.argmax(off - _SAME * np.ptp(real, axis=0)))
            if off[axis] > _SAME * np.ptp(real[:, axis]):
                raise InputError(
                    f"{field}: expected the references of log {log.name!r}, got others on axis "
                    f"{axis + 1} (by up to {off[axis]:.3g} {'rad/s' if 'velocity' in name else 'rad'})"
                )
        given[name] = real
    given |= {"start_rad": log.start_rad, "run_up": log.run_up}
    return replace(own, **given, sample_time_s=log.sample_time_s)


@dataclass(frozen=True)
class Difference:
    """User's simulator minus model along each log; arrays are (n, n_axes).

    - ``theirs_nm``: torques of the user's simulator.
    - ``torques_nm``: torque difference as compared; ``taken_nm``: as subtracted from logs.
    - ``positions_rad``: difference of the motor positions.
    """

    theirs_nm: tuple[Array, ...]
    torques_nm: tuple[Array, ...]
    taken_nm: tuple[Array, ...]
    positions_rad: tuple[Array, ...]

    def taken_from(self, logs: Sequence[Log]) -> list[Log]:
        """Return logs minus the difference, so that the model's gap becomes that of the user's simulator.

        Exact to first order of the difference, since the machine's loop responds to it too. By inverse
        dynamics, exact if simulator and machine move alike.
        """
        each = zip(logs, self.taken_nm, self.positions_rad, strict=True)
        return [_minus(log, u, x) for log, u, x in each]


def _minus(log: Log, torque_nm: Array, position_rad: Array) -> Log:
    run_up = None if log.run_up is None else log.run_up.less(position_rad[0], torque_nm[0])
    return replace(
        log,
        torque_nm=log.torque_nm - torque_nm,
        position_rad=log.position_rad - position_rad,
        run_up=run_up,
    )


def difference(view: View, simulated: Sequence[Log], settings: Settings) -> Difference:
    """Return the difference between ``simulated`` logs and the model of ``view``.

    By inverse dynamics the model follows the motion of each log, and the positions do not differ.
    """
    theirs = tuple(view.measured(own) for own in simulated)
    ours = view.torques(AS_GIVEN, simulated)
    off = tuple(their - our for their, our in zip(theirs, ours, strict=True))
    moved = [own.position_rad for own in simulated]
    if view.mode == "closed_loop":
        moved = simulated_positions(view.robot, AS_GIVEN, simulated, threads=settings.threads)
    return Difference(
        theirs,
        off,
        tuple(view.taken_off(own, less) for own, less in zip(simulated, off, strict=True)),
        tuple(own.position_rad - x for own, x in zip(simulated, moved, strict=True)),
    )


def reproduction(
    view: View, logs: Sequence[Log], simulated: Sequence[Log], off: Difference, settings: Settings
) -> Reproduction:
    """Return how well the model of ``view`` reproduces the user's simulator; ``off``: the difference of the two.

    In closed loop the difference can be subtracted from the logs. By inverse dynamics it is known along the
    motions of ``simulated``, so these must be close to the measured motions. Dry friction, which turns round
    with the speed, is off by the root of the relative distance of the motions.
    """
    real = [view.measured(log) for log in logs]
    counts = [view.counted(log) for log in logs]
    seen = [c * x for c, x in zip(counts, off.torques_nm, strict=True)]
    size = _rms(seen)

    def gap_to(others: Sequence[Array]) -> Array:
        return _rms([c * (a - b) for c, a, b in zip(counts, real, others, strict=True)])

    theirs = list(off.theirs_nm)
    taken_off = True
    if view.mode == "inverse_dynamics":
        model = view.torques(AS_GIVEN, logs)
        theirs = [a + b for a, b in zip(model, off.torques_nm, strict=True)]
        wrong = size * np.sqrt(view.apart(logs, simulated))
        taken_off = bool(np.all(wrong <= _HARMLESS * gap_to(theirs)))
        theirs = theirs if taken_off else model
    about_mean = [their - their.mean(axis=0) for their in off.theirs_nm]
    noises = view.noises(logs, 0)
    items = [ErrorLog(*each) for each in zip(logs, seen, noises, strict=True)]
    bands = band_map(items, settings.block_s)
    regimes = regime_maps(items, settings.bandwidth_hz, settings.block_s)
    return Reproduction(
        size / np.maximum(_rms(about_mean), 1e-300),
        size / np.maximum(gap_to(theirs), 1e-300),
        taken_off,
        findings(bands, regimes, settings.significance),
    )


def _rms(parts: Sequence[Array]) -> Array:
    """Return the root mean square (n_axes,) of all samples."""
    return np.asarray(np.sqrt(np.mean(np.concatenate(parts) ** 2, axis=0)))
