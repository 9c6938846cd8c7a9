"""Contents of the report's figures, in numbers and words; the templates draw them as SVG."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisight.gap.facts.result import Diagnosis, Overlay
from axisight.gap.facts.wording import removed_in_words
from axisight.report.curves import path, thin
from axisight.report.scale import Scale
from axisight.report.wording import (
    after_words,
    fit_words,
    number,
    percent,
    probability,
    ranked,
    shortened,
    standard_errors,
    title_of,
    torque_unit,
    torque_word,
)

Floats = NDArray[np.float64]

TOP = 10
MAX_OVERLAYS = 150
# Minimum and maximum for each pixel of a wide screen.
_POINTS_PER_LINE = 2_000
_POINTS_PER_REPORT = 24_000
_LEAST_POINTS = 200

# Drawing units: width of a panel, and units per pixel of height. Enough to zoom to an eighth of the time.
_WIDTH = 8_000
_FINE = 10
_TORQUE_HEIGHT, _ERROR_HEIGHT = 260, 170


def ranking_bars(diagnosis: Diagnosis) -> list[dict[str, str]]:
    """Return the bars of the most probable candidates, with lengths in per cent."""
    return [
        {
            "title": shortened(title_of(c)),
            "length": f"{100 * c.probability if np.isfinite(c.probability) else 0.0:.2f}%",
            "probability": probability(c.probability),
            "told": f"{title_of(c)}: probability {probability(c.probability)}, "
            f"held-out score {removed_in_words(c.score)}, "
            f"significance {standard_errors(c.significance)} standard errors, {fit_words(c.status)}",
        }
        for c in ranked(diagnosis)[:TOP]
    ]


def overlay_figure(diagnosis: Diagnosis, overlay: Overlay, points: int) -> dict[str, Any]:
    """Return measured and simulated torque over time, and the residuals of the simulations."""
    unit = torque_unit(diagnosis, overlay.axis)
    # An axis of unknown kind has a double unit (Nm; N), which fits no number.
    value_unit = "" if ";" in unit else f" {unit}"
    before, after = overlay.errors_nm
    time = Scale.around(overlay.time_s)
    curves = dict(zip(("measured", "before", "after"), overlay.curves_nm, strict=True))
    errors = {"before": before, "after": after}
    word = torque_word(unit)
    return {
        "axis": overlay.axis,
        "rms": [f"{number(x, 2)}{value_unit}" for x in overlay.rms_nm],
        "gap": [percent(x) for x in (overlay.gap_before, overlay.gap_after)],
        "uncounted": bool(np.any(overlay.counted == 0)),
        "names": {
            "measured": "measured",
            "before": "before, simulator as given",
            "after": after_words(diagnosis),
        },
        "told": f"{word} of axis {overlay.axis} over time: measured, before and {after_words(diagnosis)}",
        "unit": value_unit,
        "time": time,
        "panels": [
            _panel(f"{word} ({unit})", curves, overlay.time_s, time, _TORQUE_HEIGHT, points),
            _panel(f"error ({unit})", errors, overlay.time_s, time, _ERROR_HEIGHT, points),
        ],
    }


def _panel(
    title: str, curves: dict[str, Floats], time_s: Floats, time: Scale, height: int, points: int
) -> dict[str, Any]:
    scale = Scale.around(np.concatenate(list(curves.values())), margin=0.06)
    lines = []
    for kind, values in curves.items():
        kept_s, kept = thin(time_s, values, points)
        y = _FINE * height * (1 - scale.share(kept))
        lines.append({"kind": kind, "path": path(_WIDTH * time.share(kept_s), y)})
    return {
        "title": title,
        "scale": scale,
        "ticks": scale.ticks(height // 32),
        "height": height,
        "width": _WIDTH,
        "fine": _FINE,
        "lines": lines,
    }


def overlays_by_log(diagnosis: Diagnosis) -> tuple[list[dict[str, Any]], int]:
    """Return the logs with figures of their axes, one of them open, and how many figures were left out.

    Fewer points per figure keep all of them within 1.5 MB.
    """
    shown = diagnosis.overlays[:MAX_OVERLAYS]
    points = points_per_line(len(shown))
    first = first_overlay(diagnosis)
    logs: dict[str, list[dict[str, Any]]] = {}
    for i, overlay in enumerate(shown):
        figure = overlay_figure(diagnosis, overlay, points)
        logs.setdefault(overlay.log, []).append(figure | {"open": i == first})
    by_log = [{"name": name, "figures": figures} for name, figures in logs.items()]
    return by_log, len(diagnosis.overlays) - len(shown)


def points_per_line(n_overlays: int) -> int:
    """Return the number of points per line with ``n_overlays`` overlays."""
    share = _POINTS_PER_REPORT // max(1, n_overlays)
    return int(min(_POINTS_PER_LINE, max(_LEAST_POINTS, share)))


def first_overlay(diagnosis: Diagnosis) -> int:
    """Return the index of the overlay to open: that of the largest place or cause, else the first."""
    axes: Sequence[int | None] = [c.axis for c in diagnosis.causes] + [
        w.axis for w in sorted(diagnosis.where, key=lambda w: -w.share)
    ]
    shown = [overlay.axis for overlay in diagnosis.overlays[:MAX_OVERLAYS]]
    return next((shown.index(axis) for axis in axes if axis in shown), 0)
