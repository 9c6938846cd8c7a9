"""Group experiments into realizations: n experiments for n inputs that excite all directions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from axisight.arguments import Complex
from axisight.records import PeriodicRecords

T = TypeVar("T")

# Median condition number beyond which experiments in a row do not excite all directions.
_SINGULAR = 1e3
# Least correlation of copies; a shift by half a sample lowers it a little, other phases lower it to about 0.2.
_COPY = 0.99
# Amplitude of a channel, relative to the largest, below which it is not excited at a line.
_SILENT = 1e-6


@dataclass(frozen=True)
class Order:
    """The order of experiments in which each realization is n_inputs in a row.

    ``count`` is the number of realizations, 0 if no order makes whole ones. ``moved``: whether experiments
    change places. ``repeats``: whether all realizations have the same phases.
    """

    index: tuple[int, ...]
    count: int
    moved: bool
    repeats: bool


def realizations(records: PeriodicRecords) -> Order:
    """Return how experiments form realizations: in a row, or else in turn (all first ones first)."""
    n, total = records.n_inputs, records.n_experiments
    here = tuple(range(total))
    count = total // n
    if total % n or not count:
        return Order(here, 0, False, False)
    spectrum = _spectrum(records)
    if _excites_all(spectrum, here, n):
        return Order(here, count, False, _repeats(records, here, n))
    turn = tuple(e * count + m for m in range(count) for e in range(n))
    if count > 1 and _excites_all(spectrum, turn, n):
        return Order(turn, count, True, _repeats(records, turn, n))
    return Order(here, 0, False, False)


def in_order(items: Sequence[T], order: Order) -> list[T]:
    """Return items in the order of realizations."""
    return [items[i] for i in order.index]


def _signal(records: PeriodicRecords) -> NDArray[np.float64]:
    reference = records.reference
    suits = reference is not None and reference.shape[3] == records.n_inputs
    found = reference if suits and reference is not None else records.input
    return np.asarray(found.mean(axis=1))


def _spectrum(records: PeriodicRecords) -> Complex:
    """Return reference or input at the excited lines, (line, experiment, channel)."""
    found = np.fft.rfft(_signal(records), axis=1)[:, records.lines]
    return np.asarray(found.transpose(1, 0, 2))


def _excites_all(spectrum: Complex, index: Sequence[int], n: int) -> bool:
    """Whether every realization excites all inputs at most lines."""
    ordered = spectrum[:, list(index)]
    for start in range(0, len(index), n):
        block = ordered[:, start : start + n]
        norm = np.linalg.norm(block, axis=1, keepdims=True)
        condition = np.linalg.cond(block / np.where(norm > 0, norm, 1.0))
        if not np.median(condition) < _SINGULAR:
            return False
    return True


def _repeats(records: PeriodicRecords, index: Sequence[int], n: int) -> bool:
    """Whether every realization is a copy of the first one, but for a shift in time."""
    if len(index) <= n:
        return False
    spectrum = np.fft.rfft(_signal(records), axis=1)[list(index)]
    size = np.abs(spectrum)
    # Phases alone, at excited lines: a strong square wave is the same in all experiments.
    there = size > _SILENT * size.max()
    there &= np.isin(np.arange(spectrum.shape[1]), records.lines)[:, None]
    phase = np.where(there, spectrum / np.where(there, size, 1.0), 0.0)
    for i in range(n, len(index)):
        one, other = phase[i], phase[i % n]
        across = np.fft.irfft(np.sum(one * np.conj(other), axis=1))
        full = np.fft.irfft(np.sum(np.abs(one) ** 2, axis=1))[0]
        if across.max() < _COPY * full:
            return False
    return True
