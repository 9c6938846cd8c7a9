"""Effects that may be missing: the candidates, and where the fit of each begins."""
