"""Statistics and linear algebra that several kinds of fits share.

These modules import only errors from the package, and take plain arrays.
"""
