"""The posterior of a diagnosis: joint distribution of its parameters, samples, files, ranges for training."""

from axisight.posterior.between_runs import BetweenRuns
from axisight.posterior.corner import plot_corner
from axisight.posterior.data_tree import from_datatree, to_datatree
from axisight.posterior.files import load_posterior, save_posterior
from axisight.posterior.parameter import DrivenAxis, PosteriorParameter
from axisight.posterior.randomization import (
    PROJECTS,
    Randomization,
    RandomizationDocument,
    RandomizedField,
    load_randomization,
    randomization,
    randomization_document,
    save_randomization,
)
from axisight.posterior.repeated import with_repeats
from axisight.posterior.result import Posterior, PosteriorHypothesis
from axisight.posterior.sampled_robot import sampled_robot

__all__ = [
    "PROJECTS",
    "BetweenRuns",
    "DrivenAxis",
    "Posterior",
    "PosteriorHypothesis",
    "PosteriorParameter",
    "Randomization",
    "RandomizationDocument",
    "RandomizedField",
    "from_datatree",
    "load_posterior",
    "load_randomization",
    "plot_corner",
    "randomization",
    "randomization_document",
    "sampled_robot",
    "save_posterior",
    "save_randomization",
    "to_datatree",
    "with_repeats",
]
