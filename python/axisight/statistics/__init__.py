"""Statistics and linear algebra on results that several kinds of fits share.

The lowest room of the fits: it imports nothing of the package but errors, and takes plain arrays.
"""
