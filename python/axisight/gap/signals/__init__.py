"""Measured signals for themselves: motion, noise, filters, steps of encoders, standstill."""
