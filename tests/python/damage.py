"""Seeded damage of all kinds to files, and limits on what reading them may do."""

import os

import numpy as np

from reading_children import wrong

# Number of damaged files per format; `make fuzz` sets more.
TIMES = int(os.environ.get("AXISIGHT_FUZZ", "250"))


def mutated(data: bytes, rng: np.random.Generator) -> bytes:
    """Return the bytes with one kind of damage: changed, removed, repeated, cut off, or set to extremes."""
    spoiled = bytearray(data)
    at = int(rng.integers(len(data)))
    if rng.random() < 0.4:  # most formats have their structure at the ends
        at = int(rng.choice([at % 512, len(data) - 1 - at % 512])) % len(data)
    long = int(rng.integers(1, 9))
    kind = rng.integers(7)
    if kind == 0:
        spoiled[at] ^= 1 << int(rng.integers(8))
    elif kind == 1:
        spoiled[at : at + long] = rng.bytes(long)
    elif kind == 2:
        del spoiled[at : at + long]
    elif kind == 3:
        spoiled[at:at] = spoiled[at : at + 4 * long]
    elif kind == 4:
        del spoiled[at:]
    elif kind == 5:  # some formats state types as small numbers
        spoiled[at - at % 8] = int(rng.integers(32))
    else:
        spoiled[at : at + long] = rng.choice([b"\0", b"\xff", b"\x7f"]) * long
    return bytes(spoiled)


def batch(folder, path, rng, times=TIMES):
    """Write ``times`` damaged files with the suffix of the original."""
    data, paths = path.read_bytes(), []
    suffix = "".join(path.suffixes[-2:]) if path.suffix == ".gz" else path.suffix
    for number in range(times):
        paths.append(folder / f"{number}{suffix}")
        paths[-1].write_bytes(mutated(data, rng))
    return paths


def sound(outcomes):
    assert wrong(outcomes) == []
    assert any(said.startswith("refused") for said, _ in outcomes)
    assert max(used for _, used in outcomes) < 500
