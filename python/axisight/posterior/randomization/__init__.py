"""Ranges and joint draws of simulator parameters for training: any simulator, mjlab, MuJoCo Playground, Isaac Lab."""

from axisight.posterior.randomization.code import PROJECTS, Randomization, randomization
from axisight.posterior.randomization.document import RandomizationDocument
from axisight.posterior.randomization.document_files import load_randomization, save_randomization
from axisight.posterior.randomization.fields import RandomizedField
from axisight.posterior.randomization.neutral import randomization_document

__all__ = [
    "PROJECTS",
    "Randomization",
    "RandomizationDocument",
    "RandomizedField",
    "load_randomization",
    "randomization",
    "randomization_document",
    "save_randomization",
]
