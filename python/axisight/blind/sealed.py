"""The seal of a truth: its hash, in the folder of its case."""

from __future__ import annotations

import hashlib

TRUTH_SCHEMA = "axisight.truth/1"
SEAL = "truth.sha256"


def seal_of(text: str) -> str:
    """Return the SHA-256 hash of a truth in hexadecimal digits."""
    return hashlib.sha256(text.encode()).hexdigest()
