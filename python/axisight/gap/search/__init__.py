"""Searches for sets of causes: adds, drops, exchanges and merges causes until no axis has as much left as a cause."""
