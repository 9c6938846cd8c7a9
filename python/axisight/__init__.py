"""Axisight."""
