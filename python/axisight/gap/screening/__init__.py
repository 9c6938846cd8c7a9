"""One round of the search: screens every hypothesis by one linear step, and fits the promising ones."""
