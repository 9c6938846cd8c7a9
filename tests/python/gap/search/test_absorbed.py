"""Which effects an identified quantity has taken up."""

from axisight import Effect
from axisight.effects import effect_info
from axisight.robot_file.absorbed import absorbed_effects, absorbed_note


def test_all_dry_friction_is_taken_up_together() -> None:
    for name in ("coulomb_friction", "stribeck_friction", "presliding_friction"):
        assert effect_info(name).absorbed_by == ("dry_friction",)


def test_effects_of_the_axis_are_taken_up() -> None:
    own = [
        Effect("coulomb_friction", 1, {"coulomb_nm": 0.4, "smoothing_rad_s": 0.02}),
        Effect("stribeck_friction", 1, {"excess_nm": 0.2}),
        Effect("stribeck_friction", 2, {"excess_nm": 0.2}),
        Effect("quadratic_drag", 1, {"drag_nm_s2_rad2": 0.0}),
        Effect("payload", None, {"mass_kg": 3.0}),
        Effect("backlash", 1, {"half_width_rad": 1e-4}),
    ]
    new = Effect("coulomb_friction", 1, {"coulomb_nm": 0.5})
    quantities = ("dry_friction", "viscous_friction")
    out = absorbed_effects(own, quantities, axis=1, found=[new])
    assert [e.label for e in out] == ["stribeck_friction@1"]
    assert out == own[1:2]
    both = absorbed_effects(own, quantities, axis=1)
    assert [e.label for e in both] == ["coulomb_friction@1", "stribeck_friction@1"]
    assert [e.label for e in absorbed_effects(own, quantities, axis=2)] == ["stribeck_friction@2"]
    assert [e.label for e in absorbed_effects(own, ["links"], axis=None)] == ["payload"]
    assert absorbed_effects(own, [], axis=None) == []
    assert "stribeck_friction@1" in absorbed_note(out)[0] and absorbed_note([]) == []
