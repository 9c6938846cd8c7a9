"""Checks logs against the controller's law: columns, signs, units, clocks."""
