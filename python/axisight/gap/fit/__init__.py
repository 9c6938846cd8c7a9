"""Fits of a simulator with effects to logs, and what follows from their normal equations."""
