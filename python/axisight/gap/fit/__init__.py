"""Fits of a simulator with effects to logs, and what the normal equations tell of them."""
