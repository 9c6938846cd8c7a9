"""Designs the experiment that separates two causes which the logs cannot tell apart."""
