"""The motion of the runs: a slow swing of every joint with a few tones on top."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from common.expressions import Scalar, Tape

Array = np.ndarray
TWO_PI = 2 * np.pi
# A full swing in the run, then tones across the band of the identification experiments.
FREQUENCY_HZ = np.array([0.1, 1.0, 4.3, 14.1, 36.7])


@dataclass(frozen=True)
class Tones:
    """Motor-side velocity reference: ``sum a cos(w t) + b sin(w t)`` [rad/s].

    ``cosine`` and ``sine`` have shape (n_axes, n_tones). The frequencies are shared by the
    axes, so an evaluation takes one sine and one cosine per frequency.
    """

    cosine: Array
    sine: Array

    @classmethod
    def make(cls, ratio: Array, swing_rad: float = 0.35, tone_rad_s: float = 0.01) -> Tones:
        """Joint-side swing amplitude [rad] and tone amplitudes [rad/s], random phases."""
        phase = np.random.default_rng(11).uniform(0, TWO_PI, (len(ratio), len(FREQUENCY_HZ)))
        size = np.full(len(FREQUENCY_HZ), tone_rad_s)
        size[0] = swing_rad * TWO_PI * FREQUENCY_HZ[0]
        # The swing starts from rest as far as a cosine of velocity can: with a sine.
        phase[:, 0] = np.pi / 2
        motor = size / np.asarray(ratio)[:, None]
        return cls(motor * np.cos(phase), motor * np.sin(phase))

    def velocity(self, time_s: Array) -> Array:
        """References (n, n_axes) [rad/s]."""
        angle = np.outer(time_s, TWO_PI * FREQUENCY_HZ)
        return np.cos(angle) @ self.cosine.T + np.sin(angle) @ self.sine.T

    def traced(self, tape: Tape) -> tuple[list[Scalar], list[Scalar]]:
        """Velocity and its integral from zero at the time ``t``, as expressions."""
        t = tape.leaf("t")
        waves = [(tape.call("cos", t * w), tape.call("sin", t * w)) for w in TWO_PI * FREQUENCY_HZ]
        velocity, angle = [], []
        for a_row, b_row in zip(self.cosine, self.sine, strict=True):
            rate, turned = tape.constant(0.0), tape.constant(0.0)
            for (c, s), a, b, f in zip(waves, a_row, b_row, FREQUENCY_HZ, strict=True):
                w = TWO_PI * f
                rate = rate + c * float(a) + s * float(b)
                turned = turned + s * float(a / w) + (1.0 - c) * float(b / w)
            velocity.append(rate)
            angle.append(turned)
        return velocity, angle
