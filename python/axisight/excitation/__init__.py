"""Excitation: periodic signals, low crest factors, references of whole experiments."""

from axisight.excitation.crest import Clipping, CrestSearch, LpRefinement, optimize_crest_factor
from axisight.excitation.design import ExcitationDesign, Excited, excite, load_design, read_design
from axisight.excitation.directions import dft_matrix, direction_matrix
from axisight.excitation.files import read_references, write_references
from axisight.excitation.limits import Excess, LimitReport, Limits, check_limits
from axisight.excitation.lines import line_set
from axisight.excitation.multisine import (
    Multisine,
    multisine,
    random_phases,
    schroeder_phases,
)
from axisight.excitation.optimal import OptimalSpectrum, optimal_spectrum
from axisight.excitation.references import References, references
from axisight.excitation.signals import (
    PeriodicSignal,
    SteppedSine,
    chirp,
    discrete_interval_binary,
    prbs,
    square,
    stepped_sine,
    triangle,
)
from axisight.excitation.zippered import simultaneous_references, zippered

__all__ = [
    "Clipping",
    "CrestSearch",
    "Excess",
    "ExcitationDesign",
    "Excited",
    "LimitReport",
    "Limits",
    "LpRefinement",
    "Multisine",
    "OptimalSpectrum",
    "PeriodicSignal",
    "References",
    "SteppedSine",
    "check_limits",
    "chirp",
    "dft_matrix",
    "direction_matrix",
    "discrete_interval_binary",
    "excite",
    "line_set",
    "load_design",
    "multisine",
    "optimal_spectrum",
    "optimize_crest_factor",
    "prbs",
    "random_phases",
    "read_design",
    "read_references",
    "references",
    "schroeder_phases",
    "simultaneous_references",
    "square",
    "stepped_sine",
    "triangle",
    "write_references",
    "zippered",
]
