"""Robots that ship with the package."""

from importlib import resources

PRESETS = tuple(
    sorted(
        file.name.removesuffix(".toml")
        for file in resources.files(__name__).iterdir()
        if file.name.endswith(".toml")
    )
)
"""Names of the robot files in this folder."""
