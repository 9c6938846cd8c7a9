"""What faults of single rows do to a motion: whether a log may be used as it is."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.logs.filters import lowpass
from axisight.logs.log import Floats

Ints = NDArray[np.int64]

# Upper end of the band in which motions of arms are compared [Hz], and the same as a share of the sample rate.
_BAND_HZ = 10.0
_BAND_SHARE = 0.2
# Largest share of the power of the acceleration that does no harm: 3 % of its amplitude. Models of real machines
# leave more of the torque.
_HARMLESS = 1e-3
# Samples that a low-pass needs more of.
_FEWEST = 20
# Steps around a place whose median is the usual step, and which count to its fault.
_NEIGHBOURS = 7

LITTLE = "; this changes the motion too little to matter, and the log can be used"
"""End of a message about faults that do no harm."""


def is_harmless(values: Floats, wrong: Floats, sample_time_s: float) -> bool:
    """Return whether wrong steps change the acceleration of a position too little to matter.

    ``values`` (n,): the position; ``wrong`` (n - 1,): the part of its steps that faults made. Both accelerations are
    compared in the band of motions of arms. False for a position that is too short for a low-pass.
    """
    if len(values) <= _FEWEST:
        return False
    band = min(_BAND_HZ, _BAND_SHARE / sample_time_s)
    steps = np.column_stack([np.diff(values) - wrong, wrong])
    motion, fault = np.diff(lowpass(steps, sample_time_s, band), axis=0).T
    return float(fault @ fault) <= _HARMLESS * float(motion @ motion)


def deviations(values: Floats, places: Ints) -> Floats:
    """Return how far the steps (n - 1,) at and beside ``places`` are from the usual ones; zero elsewhere.

    The steps beside a place count, because a late reading is followed by a step that makes up for it, and a lost row
    is not.
    """
    step = np.diff(values)
    off = step - scipy.ndimage.median_filter(step, _NEIGHBOURS, mode="nearest")
    near = np.zeros(len(step), dtype=bool)
    near[places] = True
    return np.where(scipy.ndimage.maximum_filter1d(near, _NEIGHBOURS), off, 0.0)
