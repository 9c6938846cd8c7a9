"""Closed-loop and torque-driven simulation: one run, or many at once."""

from axisight.simulation.integrator import Integrator, Method
from axisight.simulation.noise import sensor_noise, white_noise
from axisight.simulation.run import Model, simulate, simulate_batch

__all__ = [
    "Integrator",
    "Method",
    "Model",
    "sensor_noise",
    "simulate",
    "simulate_batch",
    "white_noise",
]
