"""Checks logs against the simulator's inverse dynamics: columns, signs, units, clocks."""
