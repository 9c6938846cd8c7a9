"""Statistics and linear algebra on results that several kinds of fits share."""
