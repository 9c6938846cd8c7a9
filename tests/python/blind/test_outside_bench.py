"""benches/outside.py hands the truths of others to the score without loss."""

import runpy

import pytest

from axisight import effect_info


@pytest.fixture
def bench(request):
    return runpy.run_path(str(request.config.rootpath / "benches" / "outside.py"))


def test_largest_severity_of_all_logs_by_axis(bench):
    effect = {"effect": "backlash", "axis": 2, "params": {"half_width_rad": 3e-4}}
    entry = {"effects": "backlash", "truth": [effect], "severity": [[1.0, 4.0], [3.0, 2.0]]}
    truth = bench["truth_of"]("a", entry)
    assert truth["severity"] == [3.0, 4.0]
    assert truth["effects"] == [
        {"effect": "backlash", "axis": 2, "parameters": {"half_width_rad": 3e-4}}
    ]


def test_an_amplitude_comes_first_and_foreign_names_are_left_out(bench):
    params = {"order_1": 6.0, "height": 1.0, "cosine_1_nm": 0.1}
    found = bench["compared"]({"effect": "torque_ripple", "params": params})
    assert list(found) == ["cosine_1_nm", "order_1"]
    assert effect_info("torque_ripple").parameters[0].name == "order_1"


def test_what_the_library_does_not_have_keeps_its_name(bench):
    entry = {"effects": "outside the library", "truth": [{"effect": "wall", "axis": 1}]}
    assert [e["effect"] for e in bench["truth_of"]("a", entry)["effects"]] == ["wall"]
    nameless = bench["truth_of"]("a", {"effects": "outside the library"})
    with pytest.raises(ValueError, match="unknown effect"):
        effect_info(nameless["effects"][0]["effect"])


def test_nothing_withheld_and_no_effects_said_differ(bench):
    assert bench["truth_of"]("a", {"effects": "none"})["effects"] == []
    with pytest.raises(bench["TruthError"], match="a: truth: expected a list of effects"):
        bench["truth_of"]("a", {"effects": "backlash"})
