"""The experiment that separates two causes which the logs at hand cannot tell apart."""
