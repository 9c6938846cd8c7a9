"""Frequency responses: estimators, their uncertainty and their errors."""

from axisight.frf import errors
from axisight.frf.arithmetic_mean import arithmetic_mean
from axisight.frf.batch_solve import invert, right_divide
from axisight.frf.confidence import confidence_radius
from axisight.frf.etfe import etfe
from axisight.frf.explain import explain_flags
from axisight.frf.fast import FastMethod, fast_method
from axisight.frf.h1 import h1, h2
from axisight.frf.harmonic_mean import harmonic_mean
from axisight.frf.input_covariance import with_input_covariance
from axisight.frf.joint_input_output import joint_input_output
from axisight.frf.local_joint_input_output import local_joint_input_output
from axisight.frf.local_polynomial import local_polynomial
from axisight.frf.local_rational import local_rational
from axisight.frf.logarithmic_mean import logarithmic_mean
from axisight.frf.loop import Loop, robot_loop
from axisight.frf.mfrf import mfrf
from axisight.frf.planning import averaged_relative_error, compare_designs, predict_errors
from axisight.frf.response import Flag, frequency_response
from axisight.frf.robust import robust_method
from axisight.frf.smoothing import smooth
from axisight.frf.spectral_analysis import spectral_analysis

__all__ = [
    "FastMethod",
    "Flag",
    "Loop",
    "arithmetic_mean",
    "averaged_relative_error",
    "compare_designs",
    "confidence_radius",
    "errors",
    "etfe",
    "explain_flags",
    "fast_method",
    "frequency_response",
    "h1",
    "h2",
    "harmonic_mean",
    "invert",
    "joint_input_output",
    "local_joint_input_output",
    "local_polynomial",
    "local_rational",
    "logarithmic_mean",
    "mfrf",
    "predict_errors",
    "right_divide",
    "robot_loop",
    "robust_method",
    "smooth",
    "spectral_analysis",
    "with_input_covariance",
]
