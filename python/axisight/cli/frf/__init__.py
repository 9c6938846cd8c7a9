"""The command ``axisight frf``."""
