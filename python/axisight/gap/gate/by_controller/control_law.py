"""The torque that the controller of a robot file commands along logged references and positions.

The command is an offset plus a linear function of references and measured positions, which the log contains.
Friction, payload, springs or a delay change the motion, but the command still follows from the motion. So
consider the regression

``torque_i = a u_ref,j + b u_pos,k + c``

of a logged torque on the parts from the reference of axis j and the position of axis k. For j = k = i it has a
= b = 1 and no error. This separates wrong factors, signs, columns and times from any effect in the machine. A
limit after the controller makes flat tops, which are left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.gap.controller.feedback import as_taken, before, feedback, free_of_limits
from axisight.gap.controller.other_controllers import SHARE_OF_NYQUIST
from axisight.logs import Log, lowpass
from axisight.robot import Robot

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Upper end of the compared band [Hz]. Drives filter the torques that they report above.
_BAND_HZ = 60.0
# Samples that are compared in a period of the band's upper end.
_SAMPLES_PER_BAND = 6
# Time around a limit that is left out, in periods of the band's upper end: the low-pass smears the limit that
# far.
_SMEARED_PERIODS = 1.0
# Smallest share of the samples that must remain for a result.
_LEAST_KEPT = 0.1


@dataclass(frozen=True)
class LawFit:
    """A regression of torque on the parts from a reference and a position.

    ``explained``: share of the variance [1]; ``reference``, ``position``: factors a and b, NaN for a part that
    is constant.
    """

    explained: float
    reference: float
    position: float


class ControlLaw:
    """The parts of references and positions in the commands of one log, low-passed.

    ``step``: every ``step``-th sample is compared; ``kept`` (n, n_axes): samples away from any limit.
    """

    def __init__(self, robot: Robot, log: Log) -> None:
        reference = log.velocity_ref_rad_s
        assert reference is not None  # closed loop only
        time = log.sample_time_s
        band = min(_BAND_HZ, SHARE_OF_NYQUIST * 0.5 / time)
        self.step = max(1, int(1.0 / (time * band * _SAMPLES_PER_BAND)))
        self.sample_time_s = time
        self._band_hz = band
        self._robot = robot
        position, speed = as_taken(log)
        self._errors = {
            "reference": (reference, before(reference) * time),
            "position": (-speed, -position),
        }
        self.torque = lowpass(log.torque_nm, time, band)
        self._shares: dict[tuple[str, int, int], Array] = {}
        width = int(_SMEARED_PERIODS / (band * time))
        self.kept = np.column_stack([free_of_limits(x, width) for x in log.torque_nm.T])

    def share(self, kind: str, axis: int, source: int) -> Array:
        """Return the part of channel ``source`` in the command of ``axis``, (n,) [Nm]; axes from 0.

        ``kind``: ``reference`` or ``position``.
        """
        key = kind, axis, source
        if key not in self._shares:
            speed, angle = (x[:, source] for x in self._errors[kind])
            out = feedback(self._robot, speed, angle, axis)
            self._shares[key] = lowpass(
                np.ascontiguousarray(out), self.sample_time_s, self._band_hz
            )
        return self._shares[key]

    def fit(
        self,
        axis: int,
        reference: int,
        position: int,
        *,
        gains: int | None = None,
        shifts: tuple[int, int, int] = (0, 0, 0),
    ) -> LawFit:
        """Regress the torque of ``axis`` on a reference and a position; axes from 0.

        ``gains``: the axis whose gains are used, by default ``axis``; ``shifts``: samples by which torque,
        reference and position are read later.
        """
        own = axis if gains is None else gains
        reach = max(abs(s) for s in shifts)
        n = len(self.torque) - 2 * reach

        def read(x: Array, lag: int) -> Array:
            return x[reach + lag : reach + lag + n : self.step]

        kept = self.kept[reach + shifts[0] : reach + shifts[0] + n : self.step, axis]
        return _regress(
            read(self.torque[:, axis], shifts[0]),
            read(self.share("reference", own, reference), shifts[1]),
            read(self.share("position", own, position), shifts[2]),
            kept,
        )


def _regress(torque: Array, u_ref: Array, u_pos: Array, kept: Mask) -> LawFit:
    if kept.mean() < _LEAST_KEPT:
        return LawFit(np.nan, np.nan, np.nan)
    y = torque[kept] - torque[kept].mean()
    columns = np.column_stack([u_ref[kept], u_pos[kept]])
    columns -= columns.mean(axis=0)
    size = columns.std(axis=0)
    power = float(y @ y)
    if not power > 0.0:
        return LawFit(np.nan, np.nan, np.nan)
    moves = size > 1e-9 * max(float(size.max()), float(np.sqrt(power / len(y))))
    if not moves.any():
        return LawFit(0.0, np.nan, np.nan)
    found = np.full(2, np.nan)
    scaled = columns[:, moves] / size[moves]
    solution = np.linalg.lstsq(scaled, y, rcond=1e-12)[0]
    found[moves] = solution / size[moves]
    left = y - scaled @ solution
    return LawFit(1.0 - float(left @ left) / power, float(found[0]), float(found[1]))
