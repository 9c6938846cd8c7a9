"""The claims of chapter 9, with computed verdicts, and a study of when the cubic spring matters."""

from __future__ import annotations

import numpy as np

from axisight.graybox.flexibilities import Flexibility
from axisight.graybox.validation import fit_percent
from axisight_thesis import chapter9_cubic as cubic
from axisight_thesis.chapter9_figures import estimates, two_mass_velocity
from axisight_thesis.chapter9_machine import GEAR_RATIO, M3
from axisight_thesis.chapter9_study import (
    SETS,
    fitted,
    initial,
    measured,
    models,
    records,
    simulated,
    three_masses,
)
from axisight_thesis.chapter9_tables import STANDARD, TABLE_9_3, fits, sensitivity
from axisight_thesis.context import Context
from axisight_thesis.item import Item, Result, Statements, item

STEPS = Statements("9.5")
PUZZLE = Statements("9.5, puzzle")

_RIGID_INERTIA = M3["motor_inertia"] + GEAR_RATIO**2 * M3["arm_inertia"]
_BROADBAND = ("2", "3")
_FLEXIBLE = ("k1", "k3", "d")
_RIGID = ("J_m", "J_a", "F_v", "F_c")


@STEPS.claim("9.5.1-inertia", "Step 1 finds less inertia than step 3 (0.0280 of 0.0346 kg m^2).")
def _inertia(context: Context) -> Result:
    rigid = initial(context, STANDARD).rigid
    text = (
        f"{rigid.inertia_kg_m2:.4f} ± {rigid.inertia_standard_error:.4f} of "
        f"{_RIGID_INERTIA:.4f}: on this machine the regression is right to its standard error"
    )
    return bool(rigid.inertia_kg_m2 < 0.9 * _RIGID_INERTIA), text


@STEPS.claim("9.5.1-friction", "Step 1 finds friction as step 3 does.")
def _friction(context: Context) -> Result:
    rigid, final = initial(context, STANDARD).rigid, models(context, STANDARD)["m3"]
    apart = abs(rigid.coulomb_friction_nm / final["F_c"] - 1)
    text = (
        f"F_c {rigid.coulomb_friction_nm:.3f} and {final['F_c']:.3f}, true "
        f"{M3['coulomb_friction']}; F_v {rigid.viscous_friction_nm_s_rad:.4f} and "
        f"{final['F_v']:.4f}, true {M3['viscous_friction']}"
    )
    return bool(apart < 0.05), text


@STEPS.claim("9.5.2-notch", "The notch is higher at the larger amplitude.")
def _notch(context: Context) -> Result:
    low, high = _flexibilities(context)
    rise = high.notch.frequency_rad_s - low.notch.frequency_rad_s
    error = np.hypot(
        low.notch.frequency_standard_error_rad_s, high.notch.frequency_standard_error_rad_s
    )
    linear = cubic.by_name(context, "k3 = 0")
    text = (
        f"{low.notch.frequency_rad_s:.2f} and {high.notch.frequency_rad_s:.2f} rad/s, apart "
        f"{rise:.2f} ± {error:.2f}; without k3 the stiffness rises by {100 * linear.stiffening:.2f} %, "
        "with all friction on"
    )
    return bool(rise > 2 * error and abs(linear.stiffening) < 0.01), text


@STEPS.claim("9.5.2-amount", "The k3 of model m3 explains how much the stiffness rises, 15 %.")
def _amount(context: Context) -> Result:
    small, large = (cubic.by_name(context, n) for n in ("as in the tables", cubic.LARGE))
    text = (
        f"with it the stiffness of the notch rises by {100 * small.stiffening:.1f} %; with "
        f"k3 = {large.true:.0e} by {100 * large.stiffening:.1f} %"
    )
    return bool(small.stiffening > 0.5 * cubic.THESIS_STIFFENING), text


@STEPS.claim("9.5.2-spring", "(9.14) gives reasonable first values of k1 and k3.")
def _spring(context: Context) -> Result:
    spring = initial(context, STANDARD).spring
    if spring is None:
        return False, "no second amplitude"
    share = spring.cubic_nm_rad3 / M3["cubic_stiffness"]
    text = (
        f"k3 {spring.cubic_nm_rad3:.1e}, {100 * share:.0f} % of the truth: within one data set the "
        "points of (9.14) lie on a straight line, which pulls k3 to zero; normally distributed "
        "deflections at 1 : 2 leave 14 %"
    )
    return bool(share > 0.5), text


@STEPS.claim("9.5.3-improved", "Step 3 improves the fit substantially.")
def _improved(context: Context) -> Result:
    table = fits(context)
    gain = table.sel(estimated_on="m3").values - table.sel(estimated_on="m0").values
    text = "m3 over m0: " + ", ".join(f"{g:+.1f}" for g in gain) + " points on sets 1, 2, 3"
    return bool(gain[1:].min() > 5 and gain.min() > 0), text


@STEPS.claim("9.5.3-cross", "Cross-validation fits about as well as estimation data.")
def _cross(context: Context) -> Result:
    table = fits(context)
    other = [
        table.sel(data_set="2", estimated_on="m1") - table.sel(data_set="2", estimated_on="m2"),
        table.sel(data_set="3", estimated_on="m2") - table.sel(data_set="3", estimated_on="m1"),
    ]
    apart = [float(o) for o in other]
    text = f"own data better by {apart[0]:.1f} points on set 2, {apart[1]:.1f} on set 3"
    return bool(max(apart) < 2), text


@STEPS.claim(
    "9.5.3-triangle",
    "Without set 1, fit on sets 2 and 3 improves, the parameters become unrealistic and the fit on "
    "set 1 low.",
)
def _triangle(context: Context) -> Result:
    found = fitted(context, STANDARD, (2, 3))
    data = records(context, STANDARD).data
    table = fits(context).sel(estimated_on="m3")
    now = {n: fit_percent(measured(data[n]), simulated(found.parameters, data[n])) for n in SETS}
    gain = {n: now[n] - float(table.sel(data_set=str(n))) for n in SETS}
    values = found.parameters
    text = (
        "change of fit " + ", ".join(f"{gain[n]:+.2f}" for n in SETS) + " points; "
        f"F_c {values['F_c']:.3f}, F_v {values['F_v']:.4f}, J_a {values['J_a']:.0f}"
    )
    off = abs(values["F_c"] / M3["coulomb_friction"] - 1)
    return bool(gain[2] > 0 and gain[3] > 0 and gain[1] < -5 and off > 0.2), text


@STEPS.claim(
    "9.5.3-triangle-row",
    "On set 1 the flexibility matters little beside rigid body and friction.",
)
def _triangle_row(context: Context) -> Result:
    row = abs(sensitivity(context).sel(data_set="1")).max("change")
    flexible = float(row.sel(parameter=list(_FLEXIBLE)).max())
    rigid = float(row.sel(parameter=list(_RIGID)).min())
    return flexible < 0.1 * rigid, f"at most {flexible:.2f} points, the others at least {rigid:.1f}"


@STEPS.claim(
    "9.5.3-bode",
    "m3 without k3 and F_c agrees with the responses, but for the second of two peaks.",
)
def _bode(context: Context) -> Result:
    apart = {}
    for number, (frequency, value) in estimates(context).items():
        velocity = value / (2j * np.pi * frequency)
        model = two_mass_velocity(models(context, STANDARD)["m3"], frequency)
        error = np.abs(20 * np.log10(np.abs(velocity / model)))
        near = (frequency > 9) & (frequency < 14)
        apart[number] = float(np.median(error[~near])), float(error[near].max())
    text = "; ".join(
        f"set {n}: median {m:.1f} dB, worst from 57 to 88 rad/s {w:.0f} dB"
        for n, (m, w) in apart.items()
    )
    return all(m < 1.5 and w > 4 for m, w in apart.values()), text


@PUZZLE.claim("9.5-row", "A change of k3 by 20 % does not change the fit noticeably.")
def _row(context: Context) -> Result:
    row = sensitivity(context).sel(parameter="k3", data_set=list(_BROADBAND))
    largest = float(abs(row).max())
    thesis = max(abs(x) for pair in TABLE_9_3["k3"] for x in pair)
    return largest < 0.3, f"at most {largest:.2f} points, in the thesis {thesis}"


@PUZZLE.claim("9.5-insignificant", "k3 is therefore not significant in these data.")
def _insignificant(context: Context) -> Result:
    one = cubic.by_name(context, "as in the tables")
    times = one.estimate / one.sandwich_error
    text = (
        f"k3 = {one.estimate:.2e} ± {one.sandwich_error:.1e}, {times:.0f} standard errors from zero "
        f"(white residuals: {one.estimate / one.white_error:.0f}). Near the "
        "optimum the loss of fit is the square of a small change, under residuals of "
        f"{100 - one.fit[2]:.0f} % that it does not touch"
    )
    return bool(times < 3), text


@PUZZLE.claim("9.5-removed", "Removing k3 hardly reduces the fit.")
def _removed(context: Context) -> Result:
    one = cubic.by_name(context, "as in the tables")
    alone = cubic.by_name(context, "no third mass")
    text = (
        f"fitted again without it: {one.loss[1]:.1f} and {one.loss[2]:.1f} points lost on sets 2 and 3; "
        f"with an arm of one mass {alone.loss[1]:.1f} and {alone.loss[2]:.1f}"
    )
    return bool(max(one.loss[1:]) < 3 and max(one.loss[1:]) < 0.5 * max(alone.loss[1:])), text


@PUZZLE.claim("9.5-hidden", "The third mass hides k3: two masses underestimate it.")
def _hidden(context: Context) -> Result:
    one, alone = (cubic.by_name(context, n) for n in ("as in the tables", "no third mass"))
    three = three_masses(context, STANDARD).parameters["k3"]
    text = (
        f"true {one.true:.2e}: {one.estimate:.2e} with two masses, {three:.2e} with three; "
        f"{alone.estimate:.2e} with two where the arm is one mass"
    )
    near = [abs(x / one.true - 1) for x in (three, alone.estimate)]
    return bool(one.estimate < 0.7 * one.true and max(near) < 0.2), text


@PUZZLE.claim(
    "9.5-both",
    "A k3 large enough for the measured responses leaves two masses with less than half of it, "
    "about that of m3, and with hardly any loss of fit without it.",
)
def _both(context: Context) -> Result:
    one = cubic.by_name(context, cubic.LARGE)
    three = three_masses(context, one.case.machine).parameters["k3"]
    text = (
        f"true k3 {one.true:.0e}: stiffness of the notch rises by {100 * one.stiffening:.1f} % (thesis "
        f"{100 * cubic.THESIS_STIFFENING:.1f} %); two masses find {one.estimate:.1e} (m3 "
        f"{M3['cubic_stiffness']:.2e}) and lose {one.loss[1]:.1f} and {one.loss[2]:.1f} points without "
        f"it, three find {three:.2e}"
    )
    stiff = abs(one.stiffening / cubic.THESIS_STIFFENING - 1) < 0.3
    hidden = one.estimate < 0.5 * one.true and one.estimate < 2.5 * M3["cubic_stiffness"]
    found = abs(three / one.true - 1) < 0.2
    return bool(stiff and hidden and max(one.loss[1:]) < 3 and found), text


@PUZZLE.claim("9.5-friction", "Friction hides k3.")
def _friction_hides(context: Context) -> Result:
    one, free = (cubic.by_name(context, n) for n in ("as in the tables", "no Coulomb friction"))
    text = (
        f"without Coulomb friction {free.estimate:.2e} instead of {one.estimate:.2e}, and removing k3 "
        f"costs {free.loss[1]:.1f} and {free.loss[2]:.1f} points instead of {one.loss[1]:.1f} and "
        f"{one.loss[2]:.1f}"
    )
    return bool(abs(free.estimate / one.true - 1) < 0.5 * abs(one.estimate / one.true - 1)), text


def _flexibilities(context: Context) -> tuple[Flexibility, Flexibility]:
    low, high = initial(context, STANDARD).flexibilities
    return low, high


@item("claims-9")
def claims_9(context: Context) -> Item:
    """Return the claims of chapter 9, and the study of the cubic spring."""
    claims = (*STEPS.computed(context), *PUZZLE.computed(context))
    tables = {
        "cubic-cases": cubic.table(cubic.cases(context)),
        "cubic-masses": cubic.three_mass_table(context),
    }
    return Item(
        "claims-9", "Claims of chapter 9", tables, {"cubic": cubic.figure(context)}, tuple(claims)
    )
