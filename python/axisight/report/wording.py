"""Words and numbers for figures and pages: plain names, sensible digits, units."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.effects import title
from axisight.gap.facts.compared_quantity import Compared
from axisight.gap.facts.result import Candidate, Cause, Diagnosis, Interval, Where
from axisight.gap.facts.wording import LARGEST

Floats = NDArray[np.float64]

NO_VALUE = "–"
SIGNIFICANT_SE = 3.0
"""Standard errors from which a cell of a map is significant, unless the map's attrs state others."""

_FROM_POSITIONS = ", from positions"
_REGIMES = {"abs_speed": "speed magnitude", "speed": "speed", "accel": "acceleration"}


def plain_name(name: str) -> str:
    """Return a name in words with a capital first letter: ``input_delay`` becomes ``Input delay``."""
    return title(name)


_FITS = {
    "loss_converged": "converged",
    "step_converged": "converged",
    "exact": "exact",
    "max_iterations": "stopped early",
    "stalled": "no step lowers the loss",
    "shown_by_the_logs": "shown by the logs",
}


def fit_words(status: str) -> str:
    """Return in words how the fit of a candidate ended.

    Candidates that are no causes are fitted only as far as their rank requires.
    """
    return _FITS.get(status, status)


def place(axis: int | None, axes: tuple[int, int] | None = None) -> str:
    """Return ``axis 2``, ``axes 5 and 6``, or ``whole arm``."""
    if axes is not None:
        return f"axes {axes[0]} and {axes[1]}"
    return "whole arm" if axis is None else f"axis {axis}"


def title_of(item: Candidate | Cause) -> str:
    """Return effect and place in words."""
    return f"{plain_name(item.effect)}, {place(item.axis, item.axes)}"


def title_of_label(label: str) -> str:
    """Return ``torque_constant@2`` as ``Torque constant, axis 2``; other text as a plain name."""
    effect, at, axis = label.rpartition("@")
    if at and axis.isdigit():
        return f"{plain_name(effect)}, axis {axis}"
    if at and axis.replace(",", "").isdigit():
        first, _, second = axis.partition(",")
        return f"{plain_name(effect)}, axes {first} and {second}"
    return plain_name(label)


def regime_name(name: str) -> str:
    """Return the name of a regime in words."""
    return plain_name(_REGIMES.get(name, name))


def number(value: float, digits: int = 3) -> str:
    """Return ``value`` with ``digits`` significant digits, a true minus sign and no exponent."""
    if not math.isfinite(value):
        return _not_finite(value)
    if value == 0:
        return "0"
    exponent = math.floor(math.log10(abs(value)))
    if not -4 <= exponent < 6:
        mantissa, _, power = f"{value:.{digits - 1}e}".partition("e")
        return _minus(f"{mantissa}e{int(power)}")
    return _minus(f"{value:.{max(0, digits - 1 - exponent)}f}")


def percent(value: float, digits: int = 2) -> str:
    """Return a ratio in per cent: ``0.3142`` as ``31 %``, ``0.0123`` as ``1.2 %``."""
    if not math.isfinite(value):
        return _not_finite(value)
    if value > LARGEST:
        return f"> {100 * LARGEST:,.0f} %"
    scaled = 100.0 * value
    if scaled == 0:
        return "0 %"
    exponent = math.floor(math.log10(abs(scaled)))
    if exponent < -4:
        return "< 0.0001 %" if scaled > 0 else "> −0.0001 %"
    return _minus(f"{scaled:.{max(0, digits - 1 - exponent)}f} %")


# The space between a number and its unit.
_UNIT = re.compile(r"(?<=\d) (?=(?:%|σ|Nm|N|kNm|Hz|ms|s|rad|mrad|rad/s|kg|m|mm|°)(?![\w]))")


def unbroken(text: str) -> str:
    """Return a text with no-break spaces between numbers and units, as in ``13.1 %``."""
    return _UNIT.sub("\N{NO-BREAK SPACE}", text)


def probability(value: float) -> str:
    """Return a probability in per cent that never claims 0 or 100."""
    if not math.isfinite(value):
        return NO_VALUE
    if value > 0.999:
        return "> 99.9 %"
    if value < 0.001:
        return "< 0.1 %"
    return f"{100 * value:.1f} %" if value < 0.1 or value > 0.99 else f"{100 * value:.0f} %"


def cell_percent(share: float) -> str:
    """Return a share in whole per cent without the sign, for a small cell."""
    if not math.isfinite(share):
        return NO_VALUE
    if 0 < share < 0.005:
        return "<1"
    return _minus(str(round(100 * share)))


def standard_errors(value: float) -> str:
    """Return a significance in standard errors: one decimal below ten, none above."""
    if not math.isfinite(value):
        return _not_finite(value)
    # Adding zero turns -0.0 into 0.0.
    return _minus(f"{round(value, 1) + 0.0:.1f}" if abs(value) < 9.95 else f"{value:.0f}")


def interval_texts(interval: Interval, scale: float = 1.0) -> tuple[str, str]:
    """Return the value and ``low to high``, both with the digits that the interval's width supports."""
    value, low, high = (scale * x for x in (interval.value, interval.low, interval.high))
    finite = [x for x in (value, low, high) if math.isfinite(x)]
    largest = max((abs(x) for x in finite), default=0.0)
    width = high - low
    digits = 3
    if math.isfinite(width) and width > 0 and largest > 0:
        digits = min(8, max(2, 2 + math.floor(math.log10(largest)) - math.floor(math.log10(width))))

    def text(x: float) -> str:
        if not math.isfinite(x) or x == 0 or largest == 0:
            return number(x)
        drop = math.floor(math.log10(largest)) - math.floor(math.log10(abs(x)))
        return number(x, max(1, digits - drop))

    return text(value), f"{text(low)} to {text(high)}"


def where_text(where: Where) -> str:
    """Return a place of the gap in words: ``Axis 2, 0.5 to 6 Hz, velocity reversal``."""
    parts = [f"Axis {where.axis}"]
    if where.band_hz is not None:
        parts.append(f"{where.band_hz[0]:g} to {where.band_hz[1]:g} Hz")
    if where.regime is not None:
        parts.append(where.regime)
    return ", ".join(parts)


def after_words(diagnosis: Diagnosis) -> str:
    """Return the legend text of the ``after`` simulation."""
    if diagnosis.causes:
        return "after, causes added" if len(diagnosis.causes) > 1 else "after, cause added"
    gap = diagnosis.gap
    if math.isclose(gap.after, gap.refitted, rel_tol=1e-9) or not math.isfinite(gap.after):
        return "after, re-fitted only"
    return "after, best candidate added"


def torque_unit(diagnosis: Diagnosis, axis: int) -> str:
    """Return ``Nm`` or ``N`` by ``provenance["axis_kinds"]``, or both units if that is missing.

    If positions were compared, the text says so: the torque is then what the stated gains command, and was
    not logged.
    """
    kinds = diagnosis.provenance.get("axis_kinds")
    unit = "Nm; N if prismatic"
    if isinstance(kinds, list | tuple) and 1 <= axis <= len(kinds):
        unit = "N" if kinds[axis - 1] == "prismatic" else "Nm"
    return unit + (_FROM_POSITIONS if diagnosis.gap.compared == "positions" else "")


def torque_word(unit: str) -> str:
    """Return the word for a quantity in ``unit``, a text of `torque_unit`."""
    kind = "force" if unit.removesuffix(_FROM_POSITIONS) == "N" else "torque"
    return f"{'commanded' if unit.endswith(_FROM_POSITIONS) else 'motor'} {kind}"


def filter_words(compared: Compared, lowpass_hz: float | None) -> str:
    """Return the name of the filter on measured and simulated signals."""
    if lowpass_hz is None:
        return "Measured and simulated torque are compared as sampled, without a filter."
    what = (
        "Errors of position pass a"
        if compared == "positions"
        else "Measured and simulated torque pass the same"
    )
    return f"{what} low-pass of {number(lowpass_hz, 2)} Hz."


@dataclass(frozen=True)
class GapMap:
    """A map ready to draw: arrays (n_axes, n_columns), labels as text.

    ``share`` and ``excess`` [1], ``significance`` in standard errors; ``significant`` marks significant
    cells.
    """

    title: str
    axes: tuple[int, ...]
    columns: tuple[str, ...]
    share: Floats
    excess: Floats
    significance: Floats
    significant: NDArray[np.bool_]
    threshold: float


def gap_maps(diagnosis: Diagnosis) -> list[GapMap]:
    """Return the band map and all regime maps with cells, in order.

    Axes with the verdict *none*, and those that are not judged, have no significant cells.
    """
    quiet = [a.axis for a in diagnosis.axes if a.verdict in ("none", "not_judged")]
    candidates = [("Frequency band", "band", diagnosis.band_map)] + [
        (regime_name(name), "bin", data) for name, data in diagnosis.regime_maps.items()
    ]
    maps = [_gap_map(title, dim, data, quiet) for title, dim, data in candidates]
    return [item for item in maps if item is not None]


def _gap_map(title: str, dim: str, data: xr.Dataset, quiet: Sequence[int]) -> GapMap | None:
    if "share" not in data or not {"axis", dim} <= set(data["share"].dims):
        return None

    def values(name: str) -> Floats:
        if name not in data:
            return np.full((data.sizes["axis"], data.sizes[dim]), np.nan)
        return np.asarray(data[name].transpose("axis", dim).values, dtype=np.float64)

    share, significance = values("share"), values("significance")
    if share.size == 0:
        return None
    threshold = float(data.attrs.get("significance_threshold", SIGNIFICANT_SE))
    axes = data["axis"].values if "axis" in data.coords else np.arange(1, share.shape[0] + 1)
    labels = data[dim].values if dim in data.coords else np.arange(1, share.shape[1] + 1)
    with np.errstate(invalid="ignore"):
        significant = np.isfinite(share) & (significance >= threshold)
    significant[np.isin(axes, quiet)] = False
    return GapMap(
        title=title,
        axes=tuple(int(axis) for axis in axes),
        columns=tuple(str(label) for label in labels),
        share=share,
        excess=values("excess"),
        significance=significance,
        significant=significant,
        threshold=threshold,
    )


def share_limit(maps: Sequence[GapMap]) -> float:
    """Return the share at the dark end of the colour scale of all maps: a multiple of 10 %."""
    largest = max(
        (float(m.share[m.significant].max()) for m in maps if m.significant.any()), default=0
    )
    return min(1.0, max(0.1, math.ceil(largest * 10 - 1e-9) / 10))


def ranked(diagnosis: Diagnosis) -> list[Candidate]:
    """Return the candidates, the most probable first and those without a probability last."""

    def key(candidate: Candidate) -> float:
        return -candidate.probability if math.isfinite(candidate.probability) else math.inf

    return sorted(diagnosis.ranking, key=key)


def shortened(text: str, length: int = 48) -> str:
    """Return ``text`` cut to ``length`` characters with an ellipsis."""
    return text if len(text) <= length else text[: length - 1].rstrip() + "…"


def _minus(text: str) -> str:
    return text.replace("-", "−")


def _not_finite(value: float) -> str:
    if math.isnan(value):
        return NO_VALUE
    return "∞" if value > 0 else "−∞"
