"""Monte Carlo studies: many realizations of one identification experiment.

A run is a function of (design, seed, run). The same three give the same bits on one thread or many, on
one machine or a cluster, with or without an interruption.
"""

from axisight.montecarlo.progress import Progress
from axisight.montecarlo.result import failures, responses
from axisight.montecarlo.run import run
from axisight.montecarlo.study import (
    EffectEntry,
    Excitation,
    Measurement,
    Multisine,
    Plant,
    Spread,
    Square,
    Statistics,
    Study,
    read_study,
)

__all__ = [
    "EffectEntry",
    "Excitation",
    "Measurement",
    "Multisine",
    "Plant",
    "Progress",
    "Spread",
    "Square",
    "Statistics",
    "Study",
    "failures",
    "read_study",
    "responses",
    "run",
]
