"""Which samples are fitted together, held out together, and counted as one observation of a gain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from axisight.remainder.records import Record

Labels = NDArray[np.int64]

# Stretches of a single log, each of which is held out.
_STRETCHES = 4
# Smallest number of blocks of all logs together, whose scatter is the standard error of a gain.
_BLOCKS = 24


@dataclass(frozen=True, eq=False)
class Folds:
    """Labels of the samples of all records, one after another.

    ``fold`` (n,): logs, or stretches of a single log. ``block`` (n,): blocks within folds. ``parts``: the samples
    of each log.
    """

    fold: Labels
    block: Labels
    parts: tuple[slice, ...]

    def sums(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the sum of values (n,) in each block (n_blocks,)."""
        return np.asarray(np.bincount(self.block, weights=values), dtype=np.float64)

    def fold_sums(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the sum of values (n,) in each fold (n_folds,)."""
        return np.asarray(np.bincount(self.fold, weights=values), dtype=np.float64)


def folds_of(records: Sequence[Record], steps: int) -> Folds:
    """Return the folds of records of which every ``steps``-th sample is used."""
    lengths = [len(r.motion.time_s[::steps]) for r in records]
    ends = np.concatenate([[0], np.cumsum(lengths)])
    parts = tuple(slice(int(a), int(b)) for a, b in pairwise(ends))
    alone = len(records) == 1
    fold, block, first = [], [], 0
    for number, length in enumerate(lengths):
        place = np.arange(length) / length
        fold.append((place * _STRETCHES).astype(np.int64) if alone else np.full(length, number))
        # A whole number of blocks in each stretch.
        share = _STRETCHES * -(-_BLOCKS // (_STRETCHES * len(records)))
        block.append(first + (place * share).astype(np.int64))
        first += share
    return Folds(np.concatenate(fold), np.concatenate(block), parts)
