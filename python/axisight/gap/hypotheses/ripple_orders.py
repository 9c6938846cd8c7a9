"""Finds the orders of the motor angle that stand out in a residual."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# Largest number of waves per motor turn [1]: slots and poles of servo motors cause no stronger ones above it.
HIGHEST_ORDER = 80
# Share of the Nyquist frequency above which a wave is left out.
_OF_NYQUIST = 0.8
# Share of a log that is faded in and out.
_TAPERED = 0.05
# Share of the remaining squared residual that an order must explain.
_WORTH = 0.05
# Smallest relative determinant. For an order that hardly turns, cosine and sine are nearly the same.
_LEAST_APART = 1e-8
# Cached values that depend on the motion but not on the residual.
_KNOWN_OF_WAVES = ("spectra", "_normals")


@dataclass(frozen=True)
class Turning:
    """Residual and motor motion of one axis in one log.

    ``residual``, ``angle_rad``, ``speed_rad_s``: (n,) each, every ``sample_time_s``. The first sample of the residual
    lies ``later_s`` after that of the motion. ``bent`` (k, n): derivatives of the residual by the simulator's own
    parameters that a fit has bent to their bounds.
    """

    residual: Array
    angle_rad: Array
    speed_rad_s: Array
    sample_time_s: float
    later_s: float = 0.0
    bent: Array | None = None

    def leaving(self, residual: Array, bent: Array | None = None) -> Turning:
        """Return the same motion with another residual (n,) and ``bent``; cached values of the motion stay."""
        other = replace(self, residual=residual, bent=bent)
        vars(other).update({k: v for k, v in vars(self).items() if k in _KNOWN_OF_WAVES})
        return other

    @property
    def frequency_hz(self) -> Array:
        """Frequencies (n // 2 + 1,) of the residual's spectrum [Hz]."""
        return np.asarray(np.fft.rfftfreq(len(self.residual), self.sample_time_s))

    @cached_property
    def spectra(self) -> Complex:
        """Spectra of the cosines of all orders, then of the sines (2 orders, n // 2 + 1)."""
        order = np.arange(1, HIGHEST_ORDER + 1)[:, None]
        used = np.abs(self.speed_rad_s) * order < np.pi * _OF_NYQUIST / self.sample_time_s
        wave = np.cumprod(np.broadcast_to(np.exp(1j * self.angle_rad), used.shape), axis=0) * used
        # Fade in and out, so that the jump from the end of a log to its start adds no wave.
        wave *= _faded(len(self.angle_rad))
        spectra = np.fft.rfft(np.concatenate([wave.real, wave.imag]))
        return np.asarray(spectra * np.exp(2j * np.pi * self.frequency_hz * self.later_s))

    @cached_property
    def _normals(self) -> dict[bytes, Array]:
        """Cache of normal matrices, by response."""
        return {}

    def normal(self, response: Complex) -> Array:
        """Return the inner products of the waves of all orders after a response, without means (160, 160)."""
        key = response.tobytes()
        if key not in self._normals:
            # By Parseval's theorem from the spectra, split into real and imaginary parts.
            passed = self.spectra * (response * np.sqrt(self._parseval))
            rows = np.concatenate([passed.real, passed.imag], axis=1)
            self._normals[key] = rows @ rows.T
        return self._normals[key]

    def along(self, response: Complex, residual: Array) -> Array:
        """Return the inner products of the waves after a response with a residual (160,)."""
        seen = np.conj(np.fft.rfft(residual)) * response * self._parseval
        return np.asarray((self.spectra @ seen).real)

    @property
    def _parseval(self) -> Array:
        """Weights (n // 2 + 1,) that make a product of spectra equal to the inner product of the series.

        Zero for the mean, and for the Nyquist frequency, where a wave has no phase.
        """
        n = len(self.residual)
        weights = np.full(n // 2 + 1, 2.0 / n)
        weights[0] = 0.0
        if n % 2 == 0:
            weights[-1] = 0.0
        return weights


def turning(
    residual: Array,
    position_rad: Array,
    speed_rad_s: Array,
    sample_time_s: float,
    decimation: int,
    bent: Array | None = None,
) -> Turning:
    """Return a residual that was decimated as in `Weighting`, with angle and speed of the full log at its samples.

    ``bent``: see `Turning`.
    """
    count = len(residual)
    return Turning(
        residual,
        position_rad[::decimation][:count],
        speed_rad_s[::decimation][:count],
        sample_time_s * decimation,
        # A decimated sample lies in the middle of the samples that it replaces.
        0.5 * (decimation - 1) * sample_time_s,
        bent,
    )


def strongest_orders(
    logs: Sequence[Turning], responses: Sequence[Complex], *, count: int, least_waves: float = 0.0
) -> list[int]:
    """Return up to ``count`` integer orders of the motor angle, the first found first.

    ``responses``: for each log, the transfer from an error that repeats with the motor angle to the residual, at the
    frequencies `Turning.frequency_hz`. ``least_waves``: orders with fewer waves over the travel, or less than a wave
    from an order before, are fitted and not returned: the travel does not resolve them.

    Method: least squares of the residuals of all logs on cosine and sine of ``n phi`` after the response, with one
    amplitude and phase for all logs. One order after another is added, each fitted with those before it (orthogonal
    matching pursuit; Pati, Rezaiifar, Krishnaprasad, 1993). The search ends if an order explains less than 5 % of the
    remaining squared residual. What bent parameters of the simulator may have taken up is left out of residuals and
    waves.

    Cost: one Fourier transform for each order and log, and products of 160 values per sample. Both are cached by motion
    and response.
    """
    size = 2 * HIGHEST_ORDER
    normal, along, power = np.zeros((size, size)), np.zeros(size), 0.0
    bends = _bends(logs)
    bent_waves, bent_residual = np.zeros((size, bends[0].shape[1])), np.zeros(bends[0].shape[1])
    for log, response, bend in zip(logs, responses, bends, strict=True):
        residual = log.residual - log.residual.mean()
        normal += log.normal(response)
        along += log.along(response, residual)
        power += float(residual @ residual)
        for i, column in enumerate(bend.T):
            bent_waves[:, i] += log.along(response, column)
        bent_residual += bend.T @ residual
    normal -= bent_waves @ bent_waves.T
    along -= bent_waves @ bent_residual
    power -= float(bent_residual @ bent_residual)
    turns = max(float(np.ptp(log.angle_rad)) for log in logs) / (2 * np.pi)
    fitted: list[int] = []
    found: list[int] = []
    while len(found) < count and len(fitted) < 2 * count:
        gains = _gains(normal, along, fitted)
        best = int(np.argmax(gains))
        if not gains[best] > _WORTH * power:
            break
        order = best + 1
        near = any(abs(order - other) * turns < 1.0 for other in fitted)
        if not least_waves or (order * turns >= least_waves and not near):
            found.append(order)
        # What the travel does not resolve is fitted all the same: another order would only stand for it.
        fitted.append(order)
        power -= float(gains[best])
    return found


def _bends(logs: Sequence[Turning]) -> list[Array]:
    """Return an orthonormal basis of what bent parameters change, (n, k) for each log; k may be zero."""
    columns = [np.zeros((0, len(log.residual))) if log.bent is None else log.bent for log in logs]
    level = np.concatenate([(x - x.mean(axis=1, keepdims=True)).T for x in columns])
    basis, size, _ = np.linalg.svd(level, full_matrices=False)
    basis = basis[:, size > _LEAST_APART * size.max(initial=0.0)]
    return np.split(basis, np.cumsum([len(log.residual) for log in logs])[:-1])


def passed(series: Array, response: Complex) -> Array:
    """Return series (k, n), sampled like a residual, after a response and without means."""
    out = np.fft.rfft(series) * response
    out[:, 0] = 0.0
    return np.asarray(np.fft.irfft(out, series.shape[1]))


def _gains(normal: Array, along: Array, found: Sequence[int]) -> Array:
    """Return the fall of the sum of squares (orders,) that each order brings in addition to those found."""
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


def _faded(n: int) -> Array:
    """Return a window (n,) that rises from zero at the start of a log and falls to zero at its end, as a cosine."""
    edge = 0.5 * _TAPERED * (n - 1)
    at = np.arange(n)
    return np.asarray(
        0.5 - 0.5 * np.cos(np.pi * np.minimum(np.minimum(at, n - 1 - at) / edge, 1.0))
    )
