"""Hypotheses of a diagnosis: effects that the simulator may lack, and where the fit of each begins."""
