"""Velocity, acceleration and filtered torque from logged positions, without phase shift.

Rigid-body identification is off-line, so acausal filters and central differences are possible
(Wernholt 2004, section 4.3). They reduce amplitudes towards the edge of a band that the result names.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.logs.filters import lowpass

Array = NDArray[np.float64]
Method = Literal["butterworth", "fourier"]

_TRANSIENT = 1e-3
"""Share to which a transient from the ends of the record must fall."""
_JUMP = 4.0
"""Largest step from the last sample to the first in a period, relative to the largest step inside."""


@summarized
@dataclass(frozen=True, eq=False)
class MotionEstimate:
    """A motion without its noise, ready for a regression.

    Arrays are (n_samples, n_axes), on the side (motor or joint) of the record; on a prismatic
    axis rad reads m and Nm reads N.

    time_s
        (n_samples,), time since the start of the record, including dropped samples.
    position_rad, velocity_rad_s, acceleration_rad_s2
        Filtered position and its derivatives.
    torque_nm
        The torque through the same filter; None without torque.
    sample_time_s
        Sample time after decimation.
    band_hz
        Band in which position, velocity and acceleration are within ``amplitude_error`` of the true
        amplitudes; there is no phase shift.
    amplitude_error
        Largest relative error of an amplitude in the band.
    cutoff_hz
        Frequency at which the filter has half its gain (``"butterworth"``) or ends (``"fourier"``).
    decimation
        Factor of decimation: one of this many samples was kept.
    dropped
        Samples of the record left out at its start and end, where the filter settles.
    n_periods
        Number of averaged periods (``"fourier"``); 0 for ``"butterworth"``.
    periodicity
        Rms difference between periods relative to the rms position, of the worst axis; NaN with
        fewer than two periods.
    method
        ``"butterworth"`` or ``"fourier"``.
    """

    time_s: Array
    position_rad: Array
    velocity_rad_s: Array
    acceleration_rad_s2: Array
    torque_nm: Array | None
    sample_time_s: float
    band_hz: tuple[float, float]
    amplitude_error: float
    cutoff_hz: float
    decimation: int
    dropped: tuple[int, int]
    n_periods: int
    periodicity: float
    method: Method

    @property
    def n_samples(self) -> int:
        """Number of samples after filtering and decimation."""
        return len(self.time_s)

    def __str__(self) -> str:
        """Return one or two sentences on the filtering."""
        start, end = self.dropped
        text = (
            f"{self.n_samples} samples every {self.sample_time_s:g} s (decimation "
            f"{self.decimation}), amplitudes within {100 * self.amplitude_error:g} % up to "
            f"{self.band_hz[1]:.3g} Hz"
        )
        if self.method == "butterworth":
            return f"{text}; {start} and {end} samples dropped at the ends"
        return f"{text}; {self.n_periods} periods averaged"


def estimate_motion(
    position_rad: ArrayLike,
    torque_nm: ArrayLike | None = None,
    *,
    sample_time_s: float,
    cutoff_hz: float,
    method: Method = "butterworth",
    order: int = 4,
    period_samples: int | None = None,
    decimation: int | None = None,
    amplitude_error: float = 0.01,
) -> MotionEstimate:
    """Return position, velocity, acceleration and torque of a record, all with the same filter.

    Parameters
    ----------
    position_rad, torque_nm : (n_samples, n_axes) or (n_samples,), uniform samples.
    sample_time_s : sample time of the record [s].
    cutoff_hz : end of the band to keep [Hz]; well above the motion, well below the first resonance.
    method : ``"butterworth"``, a low-pass of ``order`` run forward and backward, with central
        differences; or ``"fourier"`` for a periodic record. ``"fourier"`` averages the periods,
        removes lines above the cutoff and differentiates the rest exactly, ``(i omega)^k``.
    order : order of the Butterworth filter; the two passes have the gain of twice that order.
    period_samples : length of a period for ``"fourier"``; the record is a whole number of them.
    decimation : keep one of this many samples. By default the largest factor for which the new
        Nyquist frequency is at least twice the cutoff (``"butterworth"``: aliases are below
        2^(-2 order) of their amplitude) or above it (``"fourier"``).
    amplitude_error : relative error of amplitudes at the edge of the reported band.

    ``"butterworth"`` drops both ends over the time in which the slowest pole falls to 0.001, because
    the result there depends on assumptions outside the record. Raises InputError naming the field.

    """
    position = _signal("position_rad", position_rad)
    torque = None if torque_nm is None else _signal("torque_nm", torque_nm)
    if torque is not None and torque.shape != position.shape:
        raise InputError(f"torque_nm: expected shape {position.shape}, got {torque.shape}")
    if not (math.isfinite(sample_time_s) and sample_time_s > 0.0):
        raise InputError(f"sample_time_s: expected a positive time, got {sample_time_s!r}")
    nyquist = 0.5 / sample_time_s
    if not 0.0 < cutoff_hz < nyquist:
        raise InputError(
            f"cutoff_hz: expected between 0 and the Nyquist frequency {nyquist:g} Hz, "
            f"got {cutoff_hz:g}"
        )
    if not 0.0 < amplitude_error < 0.5:
        raise InputError(f"amplitude_error: expected between 0 and 0.5, got {amplitude_error:g}")
    _whole("order", order)
    if decimation is not None:
        _whole("decimation", decimation)
    if method == "butterworth":
        if period_samples is not None:
            raise InputError('period_samples: expected none for "butterworth"')
        step = decimation or max(1, int(nyquist / (2.0 * cutoff_hz)))
        return _butterworth(
            position, torque, sample_time_s, cutoff_hz, order, step, amplitude_error
        )
    if method == "fourier":
        return _fourier(position, torque, sample_time_s, cutoff_hz, period_samples, decimation)
    raise InputError(f'method: expected "butterworth" or "fourier", got {method!r}')


def amplitude_gain(
    frequency_hz: ArrayLike,
    *,
    sample_time_s: float,
    cutoff_hz: float,
    order: int = 4,
    derivative: int = 0,
) -> Array:
    """Return the gain of ``"butterworth"`` on position (0), velocity (1) or acceleration (2).

    It is the gain of the two passes, ``1 / (1 + (tan(pi f T) / tan(pi f_c T))^(2 order))``, times that
    of the central difference, ``sin(w T) / (w T)`` or ``(sin(w T / 2) / (w T / 2))^2``.
    ``frequency_hz`` is in Hz, ``sample_time_s`` [s] is that before decimation, ``derivative`` is 0, 1
    or 2, and ``cutoff_hz`` [Hz] and ``order`` are those of the filter.
    """
    f = np.asarray(frequency_hz, dtype=np.float64)
    warped = np.tan(np.pi * f * sample_time_s) / math.tan(math.pi * cutoff_hz * sample_time_s)
    gain = 1.0 / (1.0 + warped ** (2 * order))
    if derivative == 1:
        gain = gain * np.sinc(2.0 * f * sample_time_s)
    elif derivative == 2:
        gain = gain * np.sinc(f * sample_time_s) ** 2
    elif derivative != 0:
        raise InputError(f"derivative: expected 0, 1 or 2, got {derivative!r}")
    return np.asarray(gain, dtype=np.float64)


def _butterworth(
    position: Array,
    torque: Array | None,
    step: float,
    cutoff_hz: float,
    order: int,
    decimation: int,
    error: float,
) -> MotionEstimate:
    poles = scipy.signal.butter(order, 2.0 * cutoff_hz * step, output="zpk")[1]
    slowest = float(np.abs(poles).max())
    # At least one sample, for the central difference.
    trim = max(1, math.ceil(math.log(_TRANSIENT) / math.log(slowest)))
    n = len(position)
    if n - 2 * trim < 2 * decimation:
        raise InputError(
            f"position_rad: expected more than {2 * (trim + decimation)} samples, for a cutoff of "
            f"{cutoff_hz:g} Hz spoils {trim} at either end, got {n}"
        )
    smooth = lowpass(position, step, cutoff_hz, order)
    keep = np.arange(trim, n - trim, decimation)
    before, here, after = smooth[keep - 1], smooth[keep], smooth[keep + 1]

    def excess(f: float) -> float:
        losses = [
            1.0
            - float(
                amplitude_gain(
                    f, sample_time_s=step, cutoff_hz=cutoff_hz, order=order, derivative=k
                )
            )
            for k in range(3)
        ]
        return max(losses) - error

    # Every gain falls with frequency, to one half or less at the cutoff, so a root exists.
    edge = float(scipy.optimize.brentq(excess, 1e-9 * cutoff_hz, cutoff_hz))
    return MotionEstimate(
        time_s=np.asarray(keep * step, dtype=np.float64),
        position_rad=here,
        velocity_rad_s=(after - before) / (2.0 * step),
        acceleration_rad_s2=(after - 2.0 * here + before) / step**2,
        torque_nm=None if torque is None else lowpass(torque, step, cutoff_hz, order)[keep],
        sample_time_s=step * decimation,
        band_hz=(0.0, edge),
        amplitude_error=error,
        cutoff_hz=float(cutoff_hz),
        decimation=decimation,
        dropped=(trim, n - 1 - int(keep[-1])),
        n_periods=0,
        periodicity=math.nan,
        method="butterworth",
    )


def _fourier(
    position: Array,
    torque: Array | None,
    step: float,
    cutoff_hz: float,
    period_samples: int | None,
    decimation: int | None,
) -> MotionEstimate:
    n = len(position) if period_samples is None else _whole("period_samples", period_samples)
    if n < 4 or len(position) % n:
        raise InputError(
            f"period_samples: expected a divisor of the {len(position)} samples, from 4, got {n}"
        )
    periods = position.reshape(-1, n, position.shape[1])
    mean = periods.mean(axis=0)
    _refuse_jump(mean)
    last = int(cutoff_hz * n * step * (1.0 + 1e-12))
    if last < 1:
        raise InputError(
            f"cutoff_hz: expected at least the first line {1.0 / (n * step):g} Hz, got {cutoff_hz:g}"
        )
    # The largest decimation that divides the period and keeps the highest line below Nyquist.
    factor = decimation or max(d for d in range(1, n) if n % d == 0 and n // d > 2 * last)
    if n % factor or n // factor <= 2 * last:
        raise InputError(
            f"decimation: expected a divisor of the {n} samples of a period that leaves more "
            f"than {2 * last} samples, got {factor}"
        )
    omega = 2.0 * np.pi * np.arange(last + 1)[:, None] / (n * step)

    def lines(x: Array, power: int) -> Array:
        spectrum = np.fft.rfft(x, axis=0)[: last + 1] * (1j * omega) ** power
        return np.fft.irfft(spectrum, n // factor, axis=0) / factor

    scatter = math.nan
    if len(periods) > 1:
        spread = np.sqrt(np.mean((periods - mean) ** 2, axis=(0, 1)))
        size = np.sqrt(np.mean((mean - mean.mean(axis=0)) ** 2, axis=0))
        scatter = float(np.max(spread[size > 0] / size[size > 0], initial=0.0))
    drive = None if torque is None else torque.reshape(-1, n, torque.shape[1]).mean(axis=0)
    return MotionEstimate(
        time_s=np.arange(n // factor, dtype=np.float64) * (step * factor),
        position_rad=lines(mean, 0),
        velocity_rad_s=lines(mean, 1),
        acceleration_rad_s2=lines(mean, 2),
        torque_nm=None if drive is None else lines(drive, 0),
        sample_time_s=step * factor,
        band_hz=(0.0, last / (n * step)),
        amplitude_error=0.0,
        cutoff_hz=float(cutoff_hz),
        decimation=factor,
        dropped=(0, 0),
        n_periods=len(periods),
        periodicity=scatter,
        method="fourier",
    )


def _refuse_jump(period: Array) -> None:
    """Raise InputError for a record that is not periodic, because it would leak into all derivatives."""
    inside = np.abs(np.diff(period, axis=0)).max(axis=0)
    across = np.abs(period[0] - period[-1])
    open_axes = np.flatnonzero(across > _JUMP * inside)
    if open_axes.size:
        axis = int(open_axes[0])
        raise InputError(
            f"position_rad: expected a whole number of periods, but axis {axis + 1} jumps by "
            f"{across[axis]:.3g} from the end to the start (largest step inside "
            f'{inside[axis]:.3g}); use method="butterworth" or another period_samples'
        )


def _signal(field: str, value: ArrayLike) -> Array:
    try:
        given = np.asarray(value)
        if given.dtype.kind not in "fiu":
            raise TypeError(f"got {given.dtype}")
        x = given.astype(np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{field}: expected real numbers: {error}") from None
    if x.ndim not in {1, 2} or x.size == 0:
        raise InputError(f"{field}: expected shape (n,) or (n, n_axes), got {x.shape}")
    if not np.isfinite(x).all():
        raise InputError(
            f"{field}: expected finite values, got {int((~np.isfinite(x)).sum())} NaN or infinite"
        )
    return x[:, None] if x.ndim == 1 else x


def _whole(field: str, value: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 1:
        raise InputError(f"{field}: expected a positive integer, got {value!r}")
    return int(value)
