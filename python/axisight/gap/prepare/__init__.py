"""Prepares logs for a comparison: the part used, the start, currents, references and targets."""
