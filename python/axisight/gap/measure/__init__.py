"""Measures where the gap lies, how far it shrinks on validation logs, and which effects these logs would show."""
