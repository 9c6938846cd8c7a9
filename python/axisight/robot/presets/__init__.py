"""Robots that ship with the package, and the effects their simulators model."""

from axisight.effects import Effect

PRESETS: dict[str, tuple[Effect, ...]] = {
    "irb6600_like": (),
    # Wernholt (2004), Table 9.1, model m3; the sign function smoothed over 0.01 rad/s.
    "two_mass_axis": (
        Effect("nonlinear_stiffness", 1, {"cubic_nm_rad3": 3.72e10}),
        Effect("coulomb_friction", 1, {"coulomb_nm": 0.644, "smoothing_rad_s": 0.01}),
    ),
}
