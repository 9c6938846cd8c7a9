"""From a search to a verdict in words."""
