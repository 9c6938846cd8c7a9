"""A sampled system with a known transient, and a second implementation of the local methods."""

import numpy as np
from scipy.signal import lfilter

POLES = (0.9 * np.exp(0.8j), 0.9 * np.exp(-0.8j))


class System:
    """Transfer matrix with a common denominator and random numerators of the same order."""

    def __init__(self, n_outputs, n_inputs, poles=POLES, seed=0):
        self.denominator = np.real(np.poly(poles))
        n = len(self.denominator)
        self.numerators = np.random.default_rng(seed).normal(size=(n_outputs, n_inputs, n))

    def response(self, lines, n_samples):
        """Return G(exp(i w T)) at lines of records of n_samples, (line, output, input)."""
        powers = np.exp(-2j * np.pi * np.asarray(lines) / n_samples)[:, None] ** np.arange(
            len(self.denominator)
        )
        numerators = np.einsum("oin,kn->koi", self.numerators, powers)
        return numerators / (powers @ self.denominator)[:, None, None]

    def run(self, u, rng, transient=1.0):
        """Return the output (experiment, sample, output) from a random initial state."""
        n_outputs, n_inputs, n = self.numerators.shape
        y = np.zeros((*u.shape[:2], n_outputs))
        for e in range(len(u)):
            for o in range(n_outputs):
                for i in range(n_inputs):
                    state = transient * rng.normal(size=n - 1)
                    y[e, :, o] += lfilter(
                        self.numerators[o, i], self.denominator, u[e, :, i], zi=state
                    )[0]
        return y


def plain_local_model(u, y, line, *, order, denominator_order, half_width):
    """Return one line by one least-squares problem in monomials of the line number, for one output.

    Response (n_inputs,) and, for denominator_order 0, its variance; all unknowns in one matrix, solved by
    LAPACK's singular value decomposition.
    """
    experiments, n_samples, n_inputs = u.shape
    spectrum_u, spectrum_y = np.fft.fft(u, axis=1), np.fft.fft(y[..., 0], axis=1)
    r = np.arange(-half_width, half_width + 1)
    first = min(max(line - half_width, 1), (n_samples - 1) // 2 - 2 * half_width)
    k = first + np.arange(2 * half_width + 1)
    r = (k - line) / half_width
    powers = r[:, None] ** np.arange(order + 1)
    blocks, right = [], []
    for e in range(experiments):
        own = np.zeros((len(k), experiments, order + 1))
        own[:, e] = powers
        numerators = [spectrum_u[e, k, i, None] * powers for i in range(n_inputs)]
        output = spectrum_y[e, k]
        below = [-(r**s * output)[:, None] for s in range(1, denominator_order + 1)]
        blocks.append(np.hstack([*numerators, own.reshape(len(k), -1), *below]))
        right.append(output)
    matrix, right = np.vstack(blocks), np.concatenate(right)
    scale = np.linalg.norm(matrix, axis=0)
    solution = np.linalg.lstsq(matrix / scale, right, rcond=None)[0] / scale
    freedom = len(right) - matrix.shape[1]
    power = np.sum(np.abs(right - matrix @ solution) ** 2) / freedom
    covariance = power * np.linalg.inv(matrix.conj().T @ matrix)
    at = np.arange(n_inputs) * (order + 1)
    return solution[at], covariance[at, at].real


def band(variance, degrees_of_freedom, probability=0.95):
    """Return the squared radius of the exact band for an estimated variance."""
    q = degrees_of_freedom
    return q * ((1 - probability) ** (-1 / q) - 1) * variance
