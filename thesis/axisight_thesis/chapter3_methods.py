"""The identification methods that chapter 3 compares, each from one experiment to G at the lines."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from axisight import frf
from axisight.blackbox import arx, box_jenkins, polynomial_model
from axisight.records.experiment import Experiment
from axisight.records.periodic import PeriodicRecords
from axisight_thesis.chapter3_loop import LINES, D, P, Q, ratio

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

HIGH_ORDER = 30


def box_jenkins_direct(x: Experiment) -> Complex:
    """Return G by the direct method with a noise model that fits."""
    model = box_jenkins(x, nb=2, nc=1, nd=1, nf=2)
    return _at_lines(model.response(LINES)["response"].values)


def output_error_direct(x: Experiment) -> Complex:
    """Return G by the direct method with the noise model fixed to one."""
    return _at_lines(polynomial_model(x, nb=2, nf=2).response(LINES)["response"].values)


def slow_noise_direct(x: Experiment) -> Complex:
    """Return G by the direct method with the noise model fixed to 1/D, which is nearly H_0.

    The prediction errors are those of an output-error model of signals filtered by D.
    """
    u, y = (signal.lfilter(D, [1.0], s, axis=0) for s in (x.input, x.output))
    return output_error_direct(Experiment(x.sample_time_s, u, y))


def output_error_indirect(x: Experiment) -> Complex:
    """Return G from an output-error model from r to y and the known controller."""
    closed = polynomial_model(Experiment(x.sample_time_s, _known(x), x.output), nb=3, nf=3)
    g = _at_lines(closed.response(LINES)["response"].values)
    return np.asarray(g / (1 - ratio(P, Q) * g))


def output_error_joint(x: Experiment) -> Complex:
    """Return G as the quotient of output-error models from r to y and from r to u."""
    r = _known(x)
    outputs = polynomial_model(Experiment(x.sample_time_s, r, x.output), nb=3, nf=3)
    inputs = polynomial_model(Experiment(x.sample_time_s, r, x.input), nb=4, nf=3, nk=0)
    top, bottom = (m.response(LINES)["response"].values for m in (outputs, inputs))
    return _at_lines(top / bottom)


def high_order_direct(x: Experiment, order: int = HIGH_ORDER) -> Complex:
    """Return G by the direct method with an ARX model of high order: flexible plant and noise."""
    return _at_lines(arx(x, na=order, nb=order).response(LINES)["response"].values)


def high_order_indirect(x: Experiment, order: int = HIGH_ORDER) -> Complex:
    """Return G from an ARX model of high order from r to y, and the known controller."""
    g = high_order_direct(Experiment(x.sample_time_s, _known(x), x.output), order)
    return np.asarray(g / (1 - ratio(P, Q) * g))


def spectral_direct(x: Experiment, period: int) -> Complex:
    """Return G by H1 at the lines of a periodic reference, with one record per period."""
    count = x.n_samples // period

    def cut(s: Real) -> Real:
        return s[: count * period].reshape(1, count, period, 1)

    records = PeriodicRecords(
        x.sample_time_s, cut(x.input), cut(x.output), np.arange(1, period // 2)
    )
    return _at_lines(frf.h1(records, quantity="position", remove_drift=False)["response"].values)


def _known(x: Experiment) -> Real:
    if x.reference is None:
        raise ValueError("reference: expected the recorded one, got None")
    return x.reference


def _at_lines(g: Complex) -> Complex:
    return np.asarray(g[:, 0, 0])
