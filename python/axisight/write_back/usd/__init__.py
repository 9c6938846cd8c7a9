"""Causes written into a USD layer over the user's stage."""

from axisight.write_back.usd.model import check_usd_target, write_usd

__all__ = ["check_usd_target", "write_usd"]
