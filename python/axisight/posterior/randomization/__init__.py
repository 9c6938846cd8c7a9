"""Ranges and joint draws of simulator parameters for training: mjlab, MuJoCo Playground, Isaac Lab."""

from axisight.posterior.randomization.code import PROJECTS, Randomization, randomization
from axisight.posterior.randomization.fields import RandomizedField

__all__ = ["PROJECTS", "Randomization", "RandomizedField", "randomization"]
