"""Models what the causes leave of the gap, after the verdict."""
