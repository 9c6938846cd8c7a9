"""Logs made ready for a comparison: the part that is used, start, currents, references, targets."""
