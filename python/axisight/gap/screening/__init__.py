"""One round of the search: what every hypothesis promises, and fits of the promising ones."""
