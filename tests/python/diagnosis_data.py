"""Invented diagnoses, one per verdict, for the tests of reports and plots."""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace

import numpy as np
import xarray as xr

from axisight import Settings, load_robot
from axisight.gap.facts.result import (
    AxisVerdict,
    Candidate,
    Cause,
    DetectionLimit,
    Diagnosis,
    Finding,
    Gap,
    Interval,
    Overlay,
    Pooled,
    Remainder,
    Where,
)

BANDS = ["0.1–0.5 Hz", "0.5–2 Hz", "2–6 Hz", "6–15 Hz", "15–40 Hz", "40–100 Hz", "100–250 Hz"]
REGIMES = {
    "speed": ["< 2 rad/s", "2–20 rad/s", "20–80 rad/s", "> 80 rad/s"],
    "velocity_reversal": ["near a reversal", "away from one"],
    "position": ["−1.0 to −0.5 rad", "−0.5 to 0 rad", "0 to 0.5 rad", "0.5 to 1.0 rad"],
    "acceleration": ["low", "middle", "high"],
    "time": ["first third", "second third", "last third"],
}
VERDICTS = ("none", "explained", "explained_in_part", "unknown", "undecidable")


def shares(dim: str, labels: list[str], n_axes: int, seed: int, strength: float) -> xr.Dataset:
    """Return a map with a few significant cells on axis 2, or on the only axis."""
    rng = np.random.default_rng(seed)
    share = rng.dirichlet(np.full(len(labels), 0.7), size=n_axes)
    significance = rng.normal(0.5, 1.0, share.shape)
    row = min(1, n_axes - 1)
    significance[row] += strength * share[row]
    coords = {"axis": np.arange(1, n_axes + 1), dim: labels}
    return xr.Dataset(
        {
            "share": (("axis", dim), share),
            "excess": (("axis", dim), 1 + 8 * share),
            "significance": (("axis", dim), significance),
        },
        coords=coords,
    )


def overlay(log: str, axis: int, n: int = 6000, error: float = 0.6) -> Overlay:
    """Return an overlay: the simulator lacks friction before, and has most of it after."""
    t = np.arange(n) / 500.0
    rng = np.random.default_rng(axis)
    speed = np.sin(2 * np.pi * 0.4 * t + axis) + 0.3 * np.sin(2 * np.pi * 1.7 * t)
    base = 2.0 * np.cos(2 * np.pi * 0.4 * t + axis) + 0.8 * axis
    measured = base + error * np.sign(speed) + 0.05 * rng.standard_normal(n)
    after = base + 0.97 * error * np.tanh(30 * speed)
    std = float(measured.std())
    gaps = [float(np.sqrt(np.mean((x - measured) ** 2))) / std for x in (base, after)]
    return Overlay(log, axis, t, measured, base, after, np.ones(n), *gaps, std)


def gap(before: float, refitted: float, after: float, floor: float, n_axes: int) -> Gap:
    """Return a gap that is largest on the second axis."""
    spread = np.array([0.6, 1.5, 0.8, 0.9, 0.7, 1.1, 1.0])[:n_axes]
    return Gap(
        before, refitted, after, floor,
        before * spread, refitted * spread, after * np.ones(n_axes), floor * np.ones(n_axes),
        Pooled(0.7 * before, 0.7 * refitted, 0.7 * after, 0.7 * floor),
    )  # fmt: skip


def ranking(first: float = 0.97) -> tuple[Candidate, ...]:
    """Return twelve candidates, the most probable first."""
    rest = 1 - first
    effects = [
        ("coulomb_friction", 2, first), ("stribeck_friction", 2, 0.6 * rest),
        ("presliding_friction", 2, 0.2 * rest), ("load_dependent_friction", 2, 0.1 * rest),
        ("torque_constant", 2, 0.05 * rest), ("payload", None, 0.02 * rest),
        ("asymmetric_friction", 2, 0.01 * rest), ("viscous_friction", 2, 0.01 * rest),
        ("coulomb_friction", 1, 1e-5), ("gravity_compensation", 3, 1e-5),
        ("base_compliance", None, 1e-6), ("torque_offset", 2, 1e-7),
    ]  # fmt: skip
    return tuple(
        Candidate(e, a, p, 0.94 - 0.08 * i, 21.0 / (1 + i), "chosen" if i == 0 else "rejected")
        for i, (e, a, p) in enumerate(effects)
    )


def explained(n_axes: int = 3) -> Diagnosis:
    """Return a diagnosis in which Coulomb friction on axis 2 (or the only axis) explains the gap."""
    axis = min(2, n_axes)
    cause = Cause(
        "coulomb_friction", axis, 0.97,
        {
            "coulomb_nm": Interval(0.612, 0.583, 0.641),
            "smoothing_rad_s": Interval(1.2e-3, 0.8e-3, 1.7e-3),
            "load_ratio": Interval(0.02, -0.01, 0.05),
        },
        {"coulomb_nm": "Nm", "smoothing_rad_s": "rad/s"},
        Interval(0.94, 0.91, 0.96),
    )  # fmt: skip
    return Diagnosis(
        name="practice case 07",
        mode="closed_loop",
        verdict="explained",
        headline=f"Axis {axis} has Coulomb friction of 0.61 Nm that the simulator lacks; "
        "adding it removes 94 % of the explainable gap.",
        gap=gap(0.31, 0.29, 0.062, 0.05, n_axes),
        where=(
            Where(axis, 0.8, (0.5, 6.0), "velocity reversal", "residual steps with velocity sign"),
            Where(1, 0.12, None, None, "broad, near the floor"),
        ),
        causes=(cause,),
        alternatives=ranking()[1:3],
        equivalent=(),
        next_experiment=None,
        ranking=ranking(),
        band_map=shares("band", BANDS, n_axes, 1, 40.0),
        regime_maps={
            name: shares("bin", labels, n_axes, 2 + i, 30.0)
            for i, (name, labels) in enumerate(REGIMES.items())
        },
        overlays=tuple(
            overlay(log, i)
            for log in ("validation_multisine", "validation_trajectory")
            for i in range(1, n_axes + 1)
        ),
        refit={
            "motor_inertia_1": Interval(0.004, -0.002, 0.010),
            "stiffness_2": Interval(-0.021, -0.035, -0.007),
            "link2_mass": Interval(0.0003, -0.004, 0.005),
        },
        checks=(
            "Residual after the fit is white on every axis (largest of 12 tests: 2.1 s.e.).",
            "The gain survives on the trajectory that was not used for fitting: 93 %.",
        ),
        axes=tuple(
            AxisVerdict(
                i, "explained" if i == axis else "none", 0.2, 0.95, (0,) if i == axis else ()
            )
            for i in range(1, n_axes + 1)
        ),
        p_none=0.001,
        p_unknown=0.02,
        remainder=Remainder(
            0.037,
            np.full(n_axes, 0.037),
            (Where(1, 0.7, (6.0, 15.0), "speed: slow", "70 % of the squared gap above the floor"),),
            "speed",
        ),
        findings=(
            Finding(
                "parameter_at_edge",
                "flag",
                "ended +32 % off, at the bound",
                field="axis2.damping",
            ),
        ),
        settings=Settings().as_dict(load_robot("two_mass_axis")),
        provenance={
            "axisight_version": "0.1.0",
            "seed": 7,
            "robot": "practice",
            "robot_effects": [],
            "axis_names": [f"axis{k + 1}" for k in range(n_axes)],
            "axis_kinds": ["revolute"] * n_axes,
            "estimation_logs": ["a", "b"],
            "validation_logs": ["validation_multisine", "validation_trajectory"],
            "position_noise_std_rad": [1e-5] * n_axes,
            "references": "logged",
            "cutoff_hz": None,
            "seconds": 12.3,
        },
    )


def of(verdict: str) -> Diagnosis:
    """Return a diagnosis with this verdict."""
    base = explained()
    if verdict == "explained":
        return base
    if verdict == "undecidable":
        rival = replace(base.causes[0], effect="torque_constant", parameters={}, probability=0.48)
        return replace(
            base, verdict=verdict, causes=(rival,),
            headline="Torque constant of axis 2 and payload explain the gap equally.",
            ranking=ranking(0.48), equivalent=(("torque_constant@2", "payload"),),
            next_experiment="Hold still in two poses with a known payload of at least 5 kg.",
        )  # fmt: skip
    if verdict == "explained_in_part":
        return replace(
            base, verdict=verdict, gap=gap(0.31, 0.29, 0.15, 0.05, 3),
            next_experiment="Record axis 2 alone at three amplitudes.",
        )  # fmt: skip
    common = {"verdict": verdict, "causes": ()}
    if verdict == "none":
        return replace(
            base, **common, headline="Simulator and robot agree to within the noise.",
            gap=gap(0.052, 0.051, 0.051, 0.05, 3), where=(), alternatives=(), ranking=(), refit={},
            band_map=shares("band", BANDS, 3, 1, 0.0), regime_maps={}, overlays=base.overlays[:1],
            remainder=Remainder(0.01, np.full(3, 0.01)), findings=(), axes=(),
        )  # fmt: skip
    return replace(
        base, **common, headline="Axis 2 has a gap between 2 and 15 Hz that no effect explains.",
        gap=gap(0.31, 0.29, 0.29, 0.05, 3), alternatives=(), mode="inverse_dynamics",
        next_experiment="Record axis 2 alone at three amplitudes.",
    )  # fmt: skip


def one_prismatic() -> Diagnosis:
    """Return a diagnosis of one prismatic axis, with some shares missing."""
    base = explained(1)
    band = base.band_map.copy(deep=True)
    band["share"][0, 2:4] = np.nan
    band["significance"][0, 2:4] = np.nan
    return replace(
        base, band_map=band, provenance={"axis_kinds": ["prismatic"]},
        gap=replace(base.gap, refitted=float("nan"), refitted_per_axis=np.array([np.nan])),
    )  # fmt: skip


HOSTILE = (
    '</script><script>alert(1)</script><img src=x onerror=alert(2)> $\\frac{1$ & "q" %{y} {{ 7*7 }}'
)


def hostile() -> Diagnosis:
    """Return a diagnosis in which every text is an attack."""
    bad = HOSTILE
    base = explained()
    relabel = {"bin": [f"{bad}{i}" for i in range(4)]}
    return replace(
        base, name=bad, headline=bad, next_experiment=bad, checks=(bad,), equivalent=((bad, f"{bad}@2"),),
        where=(Where(2, 0.5, (1.0, 2.0), bad, bad),),
        causes=(Cause(bad, 2, 0.9, {bad: Interval(1, 0, 2)}, {bad: bad}, Interval(0.9, 0.8, 1.0)),),
        ranking=(Candidate(bad, 1, 0.9, 0.5, 4.0, bad), *ranking()[1:4]),
        alternatives=(Candidate(bad, None, 0.9, 0.5, 4.0, bad),),
        regime_maps={bad: base.regime_maps["speed"].assign_coords(relabel)},
        overlays=(replace(base.overlays[0], log=bad), *base.overlays[1:]),
        refit={bad: Interval(0.1, 0.0, 0.2)}, provenance={bad: {bad: bad}},
        findings=(Finding("parameter_at_edge", "flag", bad, field=bad),),
        remainder=Remainder(0.1, np.full(3, 0.1), (Where(2, 0.5, (1.0, 2.0), bad, bad),), bad),
    )  # fmt: skip


def named_everywhere(text: str) -> Diagnosis:
    """Return a diagnosis with every part, and with ``text`` in place of each text."""
    base = replace(
        explained(),
        detection_limits=(DetectionLimit("payload", None, "mass_kg", 0.2, "kg"),),
        equivalent=(("torque_constant@2", "payload"),),
        next_experiment="Hold still.",
    )
    named = _named(base, text)
    # These three fields admit only a few words.
    gap = replace(named.gap, compared=base.gap.compared)
    return replace(named, mode=base.mode, verdict=base.verdict, gap=gap)


def _named(value, text: str):
    if isinstance(value, str):
        return text
    if is_dataclass(value):
        return replace(
            value, **{f.name: _named(getattr(value, f.name), text) for f in fields(value) if f.init}
        )
    if isinstance(value, Mapping):
        return {f"{text}{i}": _named(x, text) for i, x in enumerate(value.values())}
    if isinstance(value, tuple | list):
        return type(value)(_named(x, text) for x in value)
    if isinstance(value, xr.Dataset):
        worded = [n for n, c in value.coords.items() if c.dtype.kind in "UO"]
        return value.assign_coords(
            {n: [f"{text}{i}" for i in range(value.sizes[n])] for n in worded}
        )
    return value
