"""Turns the inputs of a user into logs that can be compared."""
