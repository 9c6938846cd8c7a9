"""Identification in closed loop: direct, indirect and joint input-output, and their expected errors."""
