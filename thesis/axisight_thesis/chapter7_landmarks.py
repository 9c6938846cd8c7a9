"""Notches and peaks of the diagonal elements."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from axisight_thesis.chapter7_measures import log_mean, notch_hz, peak_db, peak_hz
from axisight_thesis.chapter7_sets import FREQUENCY_HZ

Complex = NDArray[np.complex128]

# Bands that hold the first notch and the first peak of the diagonal elements [Hz].
NOTCH_HZ = ((3.5, 7.0), (5.0, 11.0), (5.0, 12.0))
PEAK_HZ = ((7.0, 12.0), (10.5, 17.0), (10.5, 17.0))


def landmarks(sets: dict[str, Complex]) -> pd.DataFrame:
    """Return notch and peak of the diagonal elements, from logarithmic means over sets."""
    rows = []
    for name, responses in sets.items():
        mean = log_mean(responses)
        for i in range(3):
            element = mean[:, i, i]
            rows.append(
                {
                    "set": name,
                    "element": f"({i + 1},{i + 1})",
                    "notch_hz": notch_hz(FREQUENCY_HZ, element, NOTCH_HZ[i]),
                    "peak_hz": peak_hz(FREQUENCY_HZ, element, PEAK_HZ[i]),
                    "peak_db": peak_db(FREQUENCY_HZ, element, PEAK_HZ[i]),
                }
            )
    return pd.DataFrame(rows)


def triple(table: pd.DataFrame, name: str, column: str) -> list[float]:
    """Return one column of :func:`landmarks` for axes 1 to 3."""
    return [float(v) for v in table.loc[table["set"] == name, column]]
