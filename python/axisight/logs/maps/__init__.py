"""Column maps that ship with the package, for the signal names of robot makers and recorders."""

from importlib import resources

MAPS = tuple(
    sorted(
        file.name.removesuffix(".toml")
        for file in resources.files(__name__).iterdir()
        if file.name.endswith(".toml")
    )
)
"""Names of the column maps in this folder."""
