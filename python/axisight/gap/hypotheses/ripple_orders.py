"""Which orders of the motor angle stand out in a residual."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# Waves per turn of the motor [1]: slots and poles of servo motors give no higher ones of any size.
HIGHEST_ORDER = 80
# Waves are left out where they come near the Nyquist frequency of the residual.
_OF_NYQUIST = 0.8
# Share of a log that fades in and out.
_TAPERED = 0.05
# An order is worth a term when it takes so much of what the others leave.
_WORTH = 0.05
# Cosine and sine of an order that hardly turns look alike.
_LEAST_APART = 1e-8
# What a motion keeps whatever the residual is.
_KNOWN_OF_WAVES = ("spectra", "_normals")


@dataclass(frozen=True)
class Turning:
    """One axis in one log: residual (n,) and how its motor turned.

    ``angle_rad`` and ``speed_rad_s`` (n,) every ``sample_time_s``, like the residual, whose first sample
    lies ``later_s`` after theirs.
    """

    residual: Array
    angle_rad: Array
    speed_rad_s: Array
    sample_time_s: float
    later_s: float = 0.0

    def leaving(self, residual: Array) -> Turning:
        """Return the same motion with another residual (n,); what is known of its waves is kept."""
        other = replace(self, residual=residual)
        vars(other).update({k: v for k, v in vars(self).items() if k in _KNOWN_OF_WAVES})
        return other

    @property
    def frequency_hz(self) -> Array:
        """Frequencies (n // 2 + 1,) of the residual's spectrum [Hz]."""
        return np.asarray(np.fft.rfftfreq(len(self.residual), self.sample_time_s))

    @cached_property
    def spectra(self) -> Complex:
        """Spectra of the cosines of every order, then of the sines (2 orders, n // 2 + 1)."""
        order = np.arange(1, HIGHEST_ORDER + 1)[:, None]
        used = np.abs(self.speed_rad_s) * order < np.pi * _OF_NYQUIST / self.sample_time_s
        wave = np.cumprod(np.broadcast_to(np.exp(1j * self.angle_rad), used.shape), axis=0) * used
        # From nothing to nothing: the jump from the end of a log to its start is no wave.
        wave *= scipy.signal.windows.tukey(len(self.angle_rad), _TAPERED)
        spectra = np.fft.rfft(np.concatenate([wave.real, wave.imag]))
        return np.asarray(spectra * np.exp(2j * np.pi * self.frequency_hz * self.later_s))

    @cached_property
    def _normals(self) -> dict[bytes, Array]:
        """Normal matrices by response."""
        return {}

    def normal(self, response: Complex) -> Array:
        """Return the products of the waves of all orders through a response, without means (160, 160)."""
        key = response.tobytes()
        if key not in self._normals:
            # By Parseval's theorem, from the spectra: rows of real numbers, as long as a log.
            passed = self.spectra * (response * np.sqrt(self._parseval))
            rows = np.concatenate([passed.real, passed.imag], axis=1)
            self._normals[key] = rows @ rows.T
        return self._normals[key]

    def along(self, response: Complex, residual: Array) -> Array:
        """Return the products of the waves through a response with a residual (160,)."""
        seen = np.conj(np.fft.rfft(residual)) * response * self._parseval
        return np.asarray((self.spectra @ seen).real)

    @property
    def _parseval(self) -> Array:
        """Weights by which a product of spectra sums to that of the series; none of the means.

        Nor of the Nyquist frequency, where a wave has no phase.
        """
        n = len(self.residual)
        weights = np.full(n // 2 + 1, 2.0 / n)
        weights[0] = 0.0
        if n % 2 == 0:
            weights[-1] = 0.0
        return weights


def turning(
    residual: Array, position_rad: Array, speed_rad_s: Array, sample_time_s: float, decimation: int
) -> Turning:
    """Return a residual decimated as `Weighting` does, with position and speed of the full log."""
    count = len(residual)
    return Turning(
        residual,
        position_rad[::decimation][:count],
        speed_rad_s[::decimation][:count],
        sample_time_s * decimation,
        # Mirrored at its ends, a decimated sample stands in the middle of those it replaces.
        0.5 * (decimation - 1) * sample_time_s,
    )


def strongest_orders(
    logs: Sequence[Turning], responses: Sequence[Complex], *, count: int, least_turns: float = 0.0
) -> list[int]:
    """Return up to ``count`` integer orders of the motor angle, in the order they were found.

    ``responses``: for each log, from an error that repeats with the motor angle to the residual, at its
    `Turning.frequency_hz`. Least squares of the residuals of all logs on cosine and sine of
    ``n phi``, passed through the response; one order after another, each with those before it
    (orthogonal matching pursuit; Pati, Rezaiifar, Krishnaprasad, 1993), until one takes less than
    a twentieth of what is left. An order is one amplitude and phase for all logs. Orders that come
    round less often than ``least_turns`` over the travel are left out.

    Cost: a transform an order and log, and products of 160 numbers a sample, both once for all residuals
    of a motion and response.
    """
    size = 2 * HIGHEST_ORDER
    normal, along, power = np.zeros((size, size)), np.zeros(size), 0.0
    for log, response in zip(logs, responses, strict=True):
        residual = log.residual - log.residual.mean()
        normal += log.normal(response)
        along += log.along(response, residual)
        power += float(residual @ residual)
    travel = max(float(np.ptp(log.angle_rad)) for log in logs)
    comes_round = np.arange(1, HIGHEST_ORDER + 1) * travel >= 2 * np.pi * least_turns
    found: list[int] = []
    while len(found) < count:
        gains = np.where(comes_round, _gains(normal, along, found), 0.0)
        best = int(np.argmax(gains))
        if not gains[best] > _WORTH * power:
            break
        found.append(best + 1)
        power -= float(gains[best])
    return found


def passed(series: Array, response: Complex) -> Array:
    """Return series (k, n) of the sample time of a residual through a response, without means."""
    out = np.fft.rfft(series) * response
    out[:, 0] = 0.0
    return np.asarray(np.fft.irfft(out, series.shape[1]))


def _gains(normal: Array, along: Array, found: Sequence[int]) -> Array:
    """Return by how much each order, with those found, lowers the sum of squares (orders,)."""
    taken = [n - 1 for n in found]
    taken += [i + HIGHEST_ORDER for i in taken]
    if taken:
        pick = np.ix_(taken, taken)
        through = np.linalg.solve(normal[pick], normal[taken])
        rest = normal - normal[taken].T @ through
        left = along - through.T @ along[taken]
    else:
        rest, left = normal, along
    i = np.arange(HIGHEST_ORDER)
    both = np.stack([i, i + HIGHEST_ORDER], axis=1)
    pairs, right = rest[both[:, :, None], both[:, None, :]], left[both]
    scale = normal[both, both].sum(axis=1)
    determinant = np.linalg.det(pairs)
    usable = determinant > _LEAST_APART * np.maximum(scale, 1e-300) ** 2
    usable[taken[: len(found)]] = False
    solvable = np.where(usable[:, None, None], pairs, np.eye(2))
    solution = np.linalg.solve(solvable, right[:, :, None])[:, :, 0]
    return np.where(usable, np.sum(right * solution, axis=1), 0.0)
