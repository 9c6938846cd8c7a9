"""The load that an arm carries during a run."""

from __future__ import annotations

from dataclasses import dataclass

from axisight.arguments import not_negative, reals
from axisight.display.summary import summarized
from axisight.errors import InputError


@summarized
@dataclass(frozen=True)
class Load:
    """A load on the last link that carries mass.

    ``mass_kg`` [kg], the centre of mass ``centre_m`` (x, y, z) [m] in the frame of that link, and the squared
    radius of gyration ``gyration_m2`` [m^2] about every axis through the centre. These are the parameters of
    the effect ``payload``. Raises InputError for a negative mass or radius, and for numbers that are not finite.
    """

    mass_kg: float
    centre_m: tuple[float, float, float]
    gyration_m2: float = 0.0

    def __post_init__(self) -> None:
        """Check the numbers."""
        not_negative("mass_kg", self.mass_kg)
        not_negative("gyration_m2", self.gyration_m2)
        centre = reals("centre_m", self.centre_m, "three numbers", 1)
        if centre.shape != (3,):
            raise InputError(f"centre_m: expected three numbers, got {centre.size}")
        object.__setattr__(self, "centre_m", tuple(float(x) for x in centre))

    @property
    def parameters(self) -> dict[str, float]:
        """Parameters of the effect ``payload`` by name."""
        x, y, z = self.centre_m
        return {
            "mass_kg": self.mass_kg,
            "x_m": x,
            "y_m": y,
            "z_m": z,
            "gyration_m2": self.gyration_m2,
        }
