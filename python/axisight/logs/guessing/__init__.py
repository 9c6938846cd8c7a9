"""Propose a column map for a file that has none, from its names and numbers."""

from axisight.logs.guessing.propose import Proposal, guess_columns

__all__ = ["Proposal", "guess_columns"]
