"""Information of experiments: identities, oracles, sentences, comparison, misuse."""

import numpy as np
import pytest
import xarray as xr

from axisight import Effect, FitOptions, effect_parameter, load_robot, robot_parameter
from axisight import fit as fit_logs
from axisight.errors import InputError
from axisight.fitting import Weighting
from axisight.identifiability import (
    Information,
    compare_experiments,
    identifiability,
    information,
    of_covariance,
    of_fit,
    of_log_information,
    of_matrix,
    of_regressor,
    of_simulation,
    recommend_experiments,
    sources,
)

NAMES = ("axis1.stiffness", "axis1.link_inertia", "axis1.damping", "axis1.motor_inertia")
VALUES = np.array([1.46e6, 1130.0, 2630.0, 0.0121])


def two_mass_jacobian(f: np.ndarray, gear: float = 1 / 224.3) -> np.ndarray:
    """Exact derivatives of the response (torque to acceleration) by k, J_a, d, J_m (9.4), (9.5).

    With D = k + d s the arm seen through the gear weighs J_a D / (J_a s^2 + D), so
    1 / G = J_m + r^2 J_a D / (J_a s^2 + D).
    """
    k, j_a, d, j_m = VALUES
    s = 2j * np.pi * f
    spring = k + d * s
    bottom = j_a * s**2 + spring
    inverse = j_m + gear**2 * j_a * spring / bottom
    by_spring = gear**2 * j_a * (j_a * s**2) / bottom**2
    by_arm = gear**2 * spring**2 / bottom**2
    columns = [by_spring, by_arm, by_spring * s, np.ones_like(s)]
    return np.stack([-c / inverse**2 for c in columns], axis=1)


def motor_response(f: np.ndarray, gear: float = 1 / 224.3) -> np.ndarray:
    k, j_a, d, j_m = VALUES
    s = 2j * np.pi * f
    spring = k + d * s
    return 1 / (j_m + gear**2 * j_a * spring / (j_a * s**2 + spring))


def planned(low: float, high: float, name: str = "", noise: float = 0.02) -> Information:
    f = np.linspace(low, high, 60)
    return information(
        two_mass_jacobian(f),
        names=NAMES,
        scales=VALUES,
        noise_std=noise * np.abs(motor_response(f)),
        name=name,
    )


def test_information_is_the_plain_formula() -> None:
    rng = np.random.default_rng(1)
    jacobian, std = rng.normal(size=(30, 3)), rng.uniform(0.5, 2.0, 30)
    found = information(jacobian, names="abc", scales=np.ones(3), noise_std=std)
    plain = jacobian.T @ np.diag(1 / std**2) @ jacobian
    np.testing.assert_allclose(found.matrix, plain, rtol=1e-12)
    whole = information(jacobian, names="abc", scales=np.ones(3), noise_covariance=np.diag(std**2))
    np.testing.assert_allclose(whole.matrix, plain, rtol=1e-12)
    parts = [information(j, names="abc", scales=np.ones(3)) for j in (jacobian[:9], jacobian[9:])]
    blocks = information([jacobian[:9], jacobian[9:]], names="abc", scales=np.ones(3))
    np.testing.assert_allclose((parts[0] + parts[1]).matrix, blocks.matrix, rtol=1e-12)
    np.testing.assert_allclose(of_matrix(plain, names="abc", scales=np.ones(3)).matrix, plain)
    values = {"a": 1.0, "b": 1.0, "c": 0.0}
    inverse = of_covariance(np.linalg.inv(plain), values)
    np.testing.assert_allclose(inverse.matrix, plain, rtol=1e-10)


def test_standard_deviations_are_cramer_and_rao_s_whatever_the_scales() -> None:
    rng = np.random.default_rng(2)
    jacobian = rng.normal(size=(40, 4)) * [1e-6, 1.0, 1e3, 1e-2]
    expected = np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian / 0.01)))
    for scales in (np.ones(4), np.array([1e6, 1.0, 1e-3, 100.0])):
        found = identifiability(
            information(jacobian, names="abcd", scales=scales, noise_std=0.1), limit=1e9
        )
        np.testing.assert_allclose(found.std, expected, rtol=1e-9)
        assert found.rank == 4 and found.identifiable
    np.testing.assert_allclose(np.diag(found.correlation), 1.0)


def test_complex_measurements_scatter_as_predicted() -> None:
    """Linear estimates over 4000 draws: deviations to 3 / sqrt(2 * 4000) = 3.4 %."""
    rng = np.random.default_rng(3)
    jacobian = rng.normal(size=(6, 2)) + 1j * rng.normal(size=(6, 2))
    std = rng.uniform(0.5, 2, 6)
    found = identifiability(information(jacobian, names="ab", scales=np.ones(2), noise_std=std))
    noise = rng.normal(size=(4000, 6, 2)) @ [1, 1j] * std / np.sqrt(2)
    rows = np.concatenate([(jacobian / std[:, None]).real, (jacobian / std[:, None]).imag])
    data = np.concatenate([(noise / std).real, (noise / std).imag], axis=1)
    estimates = data @ np.linalg.pinv(rows).T
    np.testing.assert_allclose(estimates.std(axis=0), found.std, rtol=0.034)


def test_low_frequencies_see_one_inertia_only() -> None:
    """Far below the resonance the machine is one mass J_m + r^2 J_a: known in advance."""
    found = identifiability(planned(0.01, 0.02), limit=0.5, form="linear")
    known = [c for c in found.combinations if "axis1.link_inertia" in c.parameters]
    assert len(known) == 1 and set(known[0].parameters) == {NAMES[1], NAMES[3]}
    share = (1 / 224.3) ** 2
    # The sentence names the combination with r^2, and how well it is seen.
    assert f"{1 / share:.4g} axis1.motor_inertia" in known[0].seen[0]
    assert known[0].seen_std[0] < 0.01
    alone = [c for c in found.combinations if c is not known[0]]
    assert {p for c in alone for p in c.parameters} == {NAMES[0], NAMES[2]}


def test_ratio_of_stiffness_and_inertia_is_named() -> None:
    """A joint-side mode with the gear ratio unknown: only k / J is in its frequency."""
    rng = np.random.default_rng(4)
    by_ratio = rng.normal(size=50)
    jacobian = np.stack([by_ratio / VALUES[0], -by_ratio / VALUES[1], rng.normal(size=50)], axis=1)
    found = identifiability(
        information(jacobian, names=NAMES[:3], scales=VALUES[:3], noise_std=0.01)
    )
    assert found.rank == 2 and found.condition == np.inf
    (combination,) = found.combinations
    assert combination.kind == "unidentifiable" and combination.relative_std == np.inf
    assert found.words()[0].startswith(
        "only axis1.stiffness / axis1.link_inertia (to 0.14 %) is seen, not each of "
        "axis1.stiffness, axis1.link_inertia"
    ), found.words()
    assert np.isinf(found.relative_std[:2]).all() and np.isfinite(found.relative_std[2])
    np.testing.assert_allclose(combination.directions, [[1, 1, 0]], atol=1e-9)


def test_products_sums_and_silent_parameters_are_named() -> None:
    rng = np.random.default_rng(5)
    jacobian = np.zeros((40, 6))
    r = rng.normal(size=(40, 2))
    jacobian[:, 0], jacobian[:, 1] = r[:, 0] / 2.0, r[:, 0] / 5.0
    jacobian[:, 2], jacobian[:, 3] = r[:, 1], 0.37 * r[:, 1]
    jacobian[:, 4] = rng.normal(size=40)
    scales = np.array([2.0, 5.0, 10.0, 4.0, 1.0, 1.0])
    words = identifiability(information(jacobian, names="abcdef", scales=scales)).words()
    assert any("only a · b" in w for w in words)
    assert any("only c + 0.37 d" in w for w in words)
    assert "f: not seen at all" in words
    assert len(words) == 3
    linear = identifiability(information(jacobian, names="abcdef", scales=scales), form="linear")
    assert any("only a + 0.4 b" in w for w in linear.words())


def test_what_scales_say_does_not_change_the_rank() -> None:
    """A parameter known a million times better than another hides nothing."""
    jacobian = np.diag([1e9, 1.0, 1e-9])
    for scales in (np.ones(3), np.array([1e9, 1.0, 1e-9])):
        assert identifiability(information(jacobian, names="abc", scales=scales)).rank == 3


def test_nearly_silent_combinations_are_poor() -> None:
    rng = np.random.default_rng(6)
    jacobian = np.zeros((60, 3))
    jacobian[:, 0] = rng.normal(size=60)
    jacobian[:, 1] = -jacobian[:, 0] + 1e-4 * rng.normal(size=60)
    jacobian[:, 2] = rng.normal(size=60)
    found = identifiability(information(jacobian, names="abc", scales=np.ones(3), noise_std=0.01))
    (combination,) = found.combinations
    assert combination.kind == "poor" and found.rank == 3
    assert "only a / b" in str(combination) and "trade off" in str(combination)
    assert combination.relative_std == pytest.approx(
        found.relative_std[:2].max() * np.sqrt(2), rel=0.1
    )
    assert found.clusters == (("a", "b"),)
    assert identifiability(
        information(jacobian, names="abc", scales=np.ones(3), noise_std=1e-6)
    ).identifiable


def test_comparison_names_the_band_that_separates() -> None:
    base = planned(0.01, 0.02, "slow")
    candidates = [
        planned(0.01, 0.03, "still slow"),
        planned(2.0, 12.0, "around the resonance"),
        planned(200.0, 300.0, "far above"),
    ]
    table = compare_experiments(base, candidates)
    assert table.attrs["best"] == "around the resonance"
    separated = str(table["separates"].sel(candidate="around the resonance").values)
    assert all(name in separated for name in NAMES)
    assert "separates nothing" in str(table["words"].sel(candidate="still slow").values)
    words = recommend_experiments(base, candidates)
    assert len(words) == 1 and words[0].startswith("add around the resonance: separates")
    assert recommend_experiments(planned(2, 12), candidates) == ()
    assert compare_experiments(base, candidates[:1]).attrs["best"] == ""
    assert (table["log_det_gain"] > 0).all()


def test_two_half_experiments_are_recommended_one_after_the_other() -> None:
    eye = np.eye(3)
    base = information(eye[:1], names="abc", scales=np.ones(3), noise_std=0.01)
    halves = [
        information(
            eye[k : k + 1],
            names="abc",
            scales=np.ones(3),
            noise_std=0.01,
            name=f"e{k}",
            advice=text,
        )
        for k, text in ((1, "drive at a second amplitude"), (2, "add reversals"))
    ]
    words = recommend_experiments(base, halves)
    assert [w.split(":")[0] for w in words] == ["drive at a second amplitude", "add reversals"]


def test_regressor_with_names_and_nominal_values() -> None:
    """A point mass on a level arm turning about a vertical axis: m and first moment are silent."""
    a = np.sin(np.arange(50.0))
    data = np.zeros((50, 1, 3))
    data[:, 0, 0], data[:, 0, 1] = a, np.cos(np.arange(50.0))
    regressor = xr.DataArray(
        data,
        dims=("sample", "axis", "parameter"),
        coords={
            "parameter": ["axis1.inertia_zz", "axis1.viscous", "axis1.mass"],
            "nominal": ("parameter", [3.0, 0.0, 10.0]),
            "unit": ("parameter", ["kg m^2", "Nm s/rad", "kg"]),
        },
    )
    found = identifiability(of_regressor(regressor, 0.1), form="linear")
    assert found.words() == ("axis1.mass: not seen at all",)
    expected = 0.1 / np.linalg.norm(a) / 3.0
    assert found.relative_std[0] == pytest.approx(expected, rel=0.02)
    per_axis = of_regressor(regressor, [0.1])
    np.testing.assert_allclose(per_axis.matrix, of_regressor(regressor, 0.1).matrix)


def test_logarithmic_information_is_relative() -> None:
    found = identifiability(
        of_log_information(np.diag([1e4, 4.0]), {"a.stiffness": 2e6, "a.damping": 30.0})
    )
    np.testing.assert_allclose(found.relative_std, [0.01, 0.5])


def reference(robot, tones) -> np.ndarray:
    t = np.arange(3000) * robot.sample_time_s
    return sum(2 * np.sin(2 * np.pi * f * t + f) for f in tones)[:, None]


def test_planned_simulation_sees_what_a_fit_then_finds() -> None:
    """Of the two-mass axis about a vertical axis the mass is silent; the rest scatters in fits
    of simulated logs as the plan said."""
    robot = load_robot("two_mass_axis")
    names = ("axis1.stiffness", "axis1.inertia_scale", "axis1.motor_inertia", "axis1.mass")
    parameters = [robot_parameter(robot, n) for n in names]
    plan = of_simulation(robot, reference(robot, (1, 4, 6.5)), parameters, torque_std_nm=0.05)
    found = identifiability(plan)
    assert found.words() == ("axis1.mass: not seen at all",)
    assert found.rank == 3 and (found.relative_std[:3] < 0.05).all()


def test_coulomb_friction_and_viscous_need_two_speeds() -> None:
    """At one constant speed only their sum is seen; a second speed separates them."""
    robot = load_robot("two_mass_axis")
    effects = [Effect("torque_offset", 1, {"offset_nm": 0.1})]
    parameters = [
        robot_parameter(robot, "axis1.viscous_friction"),
        effect_parameter(effects, 0, "offset_nm"),
    ]
    plans = []
    for speed in (20.0, 40.0):
        t = np.arange(4000) * robot.sample_time_s
        ramp = speed * np.minimum(t / 0.3, 1.0)[:, None]
        plan = of_simulation(
            robot, ramp, parameters, torque_std_nm=0.05, effects=effects, name=f"{speed:g} rad/s"
        )
        plans.append(plan)
    alone = identifiability(plans[0], correlation_limit=0.9)
    both = identifiability(plans[0] + plans[1], correlation_limit=0.9)
    assert (both.relative_std < alone.relative_std).all()
    assert abs(both.correlation[0, 1]) < abs(alone.correlation[0, 1])


def test_information_of_a_finished_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = load_robot("two_mass_axis")
    plan_of = [robot_parameter(robot, n) for n in ("axis1.stiffness", "axis1.motor_inertia")]
    logs = []

    def spy(robot, given, *args, **options):
        logs.extend(given)
        return fit_logs(robot, given, *args, **options)

    monkeypatch.setattr(sources, "fit", spy)
    plan = of_simulation(robot, reference(robot, (2, 5)), plan_of, torque_std_nm=0.02)
    fitted = fit_logs(
        robot,
        logs,
        plan_of,
        weighting=Weighting(np.zeros(1), np.full((1, 1), 50.0)),
        options=FitOptions(max_iterations=2),
    )
    np.testing.assert_allclose(of_fit(fitted).matrix, plan.matrix, rtol=1e-6)
    np.testing.assert_allclose(
        of_fit(fitted).matrix, np.linalg.inv(fitted.core.covariance), rtol=1e-5
    )


ONE = {"names": ["a", "b"], "scales": [1.0, 1.0]}


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: information(np.eye(3), **ONE), "blocks of shape"),
        (lambda: information(np.eye(2) * np.nan, **ONE), "finite"),
        (lambda: information([], **ONE), "at least one measurement"),
        (lambda: information(np.eye(2), names=["a", "a"], scales=[1, 1]), "none twice"),
        (lambda: information(np.eye(2), names=["a", "b"], scales=[1, 0]), "scales"),
        (lambda: information(np.eye(2), **ONE, noise_std=-1.0), "noise_std"),
        (lambda: information(np.eye(2), **ONE, noise_std=[1.0, 1.0, 1.0]), "noise_std"),
        (lambda: information(np.eye(2), **ONE, noise_covariance=-np.eye(2)), "positive definite"),
        (lambda: information(np.eye(2), **ONE, noise_covariance=np.ones(2)), "symmetric"),
        (
            lambda: information(1j * np.eye(2), **ONE, noise_covariance=np.eye(2)),
            "real measurements",
        ),
        (lambda: of_matrix(-np.eye(2), **ONE), "semi-definite"),
        (lambda: of_matrix([[1, 2], [0, 1]], **ONE), "symmetric"),
        (lambda: of_regressor(np.eye(2), 1.0), "DataArray"),
        (lambda: identifiability(information(np.eye(2), **ONE), limit=0.0), "limit"),
        (lambda: identifiability(information(np.eye(2), **ONE), form="sum"), "form"),
        (lambda: compare_experiments(information(np.eye(2), **ONE), []), "candidates"),
        (
            lambda: (
                information(np.eye(2), **ONE)
                + information(np.eye(2), names=["a", "c"], scales=[1, 1])
            ),
            "parameters a, b",
        ),
        (
            lambda: of_simulation(
                load_robot("two_mass_axis"), np.zeros((9, 1)), [], torque_std_nm=0.0
            ),
            "torque_std_nm",
        ),
    ],
)
def test_misuse_is_named(call, words: str) -> None:
    with pytest.raises(InputError, match=words):
        call()
