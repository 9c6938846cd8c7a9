"""Parts of the explorer: what is read of verdicts, work beside the page, regards, exports, words."""

import asyncio
import json
import threading
from dataclasses import replace

import numpy as np
import pytest

from axisight import Effect, load_robot
from axisight.cli.demo import write_demo_case
from axisight.effects import effect_info
from axisight.errors import InputError
from axisight.explore.answers import answer, rest
from axisight.explore.background import Background
from axisight.explore.beside import Beside
from axisight.explore.exports import figure_png, robot_text
from axisight.explore.measured import measured_gains
from axisight.explore.plots import Regard, Responses, levels
from axisight.explore.regard import in_bins, order_spectrum, quantity, responses
from axisight.explore.said import read_said, said
from axisight.explore.session import AS_GIVEN, Session, Version
from axisight.explore.state import State
from axisight.explore.words import of_cause, of_verdict, table, text
from axisight.gap import Settings
from axisight.logs import read_case
from diagnosis_data import explained


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    case = read_case(write_demo_case(tmp_path_factory.mktemp("demo") / "case"))
    return Session("demo", load_robot(case.robot_path), case.estimation, case.validation)


def verdict(**more):
    document = explained().to_verdict()
    document["refit"] = {}
    # Made up for the report: the table of effects has no such parameter.
    document["causes"][0]["parameters"].pop("load_ratio", None)
    return json.loads(json.dumps(document | more))


def test_amplitude_of_an_order_is_found(session):
    log = session.logs[1]
    angle = log.position_rad[:, 1]
    wave = 0.3 * np.cos(5 * angle + 1.0) + 0.7
    orders, amplitude = order_spectrum(log, 1, wave)
    assert orders[np.nanargmax(amplitude)] == 5
    assert amplitude[4] == pytest.approx(0.3, rel=0.05)


def test_orders_of_a_broken_simulation_are_unknown(session):
    broken = np.full(session.logs[0].n_samples, np.nan)
    assert np.isnan(order_spectrum(session.logs[0], 0, broken)[1]).all()


def test_means_in_bins():
    x = np.linspace(-2.0, 2.0, 4001)
    middle, mean, rms = in_bins(x, 3.0 * np.sign(x))
    assert len(middle) == 40
    np.testing.assert_allclose(mean[middle < -0.1], -3.0)
    np.testing.assert_allclose(mean[middle > 0.1], 3.0)
    np.testing.assert_allclose(rms[abs(middle) > 0.1], 3.0)
    assert len(in_bins(x, np.full(4001, np.nan))[0]) == 0


def test_quantities_have_their_units(session):
    log = session.logs[2]
    speed = quantity(log, 0, "speed")
    assert np.corrcoef(speed, log.velocity_ref_rad_s[:, 0])[0, 1] > 0.95
    assert np.abs(speed).max() == pytest.approx(np.abs(log.velocity_ref_rad_s[:, 0]).max(), rel=0.2)
    assert np.abs(quantity(log, 0, "angle") - log.position_rad[:, 0]).max() < 0.05
    np.testing.assert_array_equal(quantity(log, 0, "time"), log.time_s)


def test_every_tab_has_its_answer(session):
    version = Version.of([Effect("coulomb_friction", 2, {"coulomb_nm": 0.5})])
    found = answer(session, 3, version, {"A": AS_GIVEN})
    np.testing.assert_array_equal(found.pins["A"].residual, found.given.residual)
    at = {tab: rest(session, found, 1, tab, "speed") for tab in ("against", "orders", "responses")}
    means = at["against"].against[1]
    # Friction that is missing changes sign with speed.
    off = {k: np.ptp(np.sign(x[abs(x) > 5]) * y[abs(x) > 5]) for k, (x, y) in means.items()}
    mean = {k: np.mean(np.sign(x[abs(x) > 5]) * y[abs(x) > 5]) for k, (x, y) in means.items()}
    assert mean["given"] < -0.4 and abs(mean["now"]) < 0.2, off
    assert set(at["orders"].orders) == {"given", "now"}
    assert at["responses"].responses["now"][1].shape == (300, 3)
    frequency_hz, gain = at["responses"].responses["measured"]
    assert gain.shape == (len(frequency_hz), 3)
    assert at["responses"].problem == ""


def test_a_verdict_is_read(tmp_path):
    path = tmp_path / "verdict.json"
    path.write_text(json.dumps(verdict()))
    found = read_said(path)
    assert [c.effect.label for c in found.causes] == [c.label for c in explained().causes]
    assert found.before == pytest.approx(list(explained().gap.before_per_axis))


@pytest.mark.parametrize(
    ("document", "message"),
    [
        ([], "schema"),
        ({"schema": "axisight.case/1"}, "schema"),
        ({"schema": "axisight.verdict/1"}, "headline"),
        (verdict(gap=3), "gap"),
        (verdict(causes=[{"effect": 1}]), "causes"),
        (verdict(refit={"axis1.mass": {"value": "NaN", "ci95": [0, 0]}}), "refit"),
    ],
)
def test_what_is_no_verdict_is_refused(document, message):
    with pytest.raises(InputError, match=message):
        said(document)


def test_files_that_are_no_verdict_are_refused(tmp_path):
    path = tmp_path / "verdict.json"
    for content in (b"{", b"[" * 100_000, b"\xff\xfe"):
        path.write_bytes(content)
        with pytest.raises(InputError, match=r"verdict\.json"):
            read_said(path)
    with pytest.raises(InputError, match="none"):
        read_said(tmp_path / "none.json")


def background(session, run):
    return Background(
        "demo", session.robot, session.estimation, session.validation, Settings(), run=run
    )


def test_verdict_of_another_robot_is_refused(session):
    work = background(session, None)
    cause = verdict()["causes"][0] | {"axis": 9}
    state = State(session, work)
    with pytest.raises(InputError, match="not of this robot"):
        state.hear(verdict(causes=[cause]))
    with pytest.raises(InputError, match="not of this robot"):
        state.hear(verdict(refit={"axis9.mass": {"value": 0.1, "ci95": [0.0, 0.2]}}))
    assert state.said is None


def test_work_beside_the_page_says_how_far_it_is_and_stops(session):
    begun, go = threading.Event(), threading.Event()

    def run(progress, **_):
        progress("fitting", 1, 4)
        begun.set()
        go.wait(10)
        progress("fitting", 2, 4)
        return explained()

    work = background(session, run)
    work.start()
    assert begun.wait(10)
    assert (work.state, work.says, work.share) == ("running", "fitting: 1 of 4", 0.25)
    work.stop()
    assert work.state == "stopping"
    go.set()
    work.wait(10)
    assert (work.state, work.document) == ("stopped", None)
    work.start()
    work.wait(10)
    assert work.state == "done" and work.document["headline"] == explained().headline


def test_work_that_fails_says_why(session):
    def run(**_):
        raise InputError("no logs")

    work = background(session, run)
    work.start()
    work.wait(10)
    assert (work.state, work.says) == ("failed", "no logs")


def test_causes_of_the_robot_file_can_be_taken_out(session, tmp_path):
    own = Effect("coulomb_friction", 2, {"coulomb_nm": 0.4})
    first = tmp_path / "with.toml"
    first.write_text(robot_text(session, Version.of([own])))
    robot = load_robot(first)
    (effect,) = robot.effects
    assert effect.values()[0] == 0.4
    with_own = Session("demo", robot, session.estimation, session.validation)
    state = State(with_own, background(session, None))
    assert [e.label for e in state.chosen] == ["coulomb_friction@2"]
    state.take_out("coulomb_friction@2")
    out = with_own.see(0, state.version())
    np.testing.assert_allclose(out.simulated, session.see(0).simulated, atol=1e-9)
    second = tmp_path / "without.toml"
    second.write_text(robot_text(with_own, state.version()))
    assert load_robot(second).effects == ()


def test_robot_file_has_what_was_chosen(session, tmp_path):
    name = "axis1.mass"
    value = 1.1 * session.robot.parameters()[name]
    made = Version.of([Effect("payload", None, {"mass_kg": 12.0})], {name: value})
    path = tmp_path / "robot.toml"
    path.write_text(robot_text(session, made))
    assert path.read_text().startswith("# Axisight ")
    robot = load_robot(path)
    assert [e.label for e in robot.effects] == ["payload"]
    assert robot.parameters()[name] == pytest.approx(value)
    again = Session("demo", robot, session.estimation, session.validation)
    np.testing.assert_allclose(again.see(0).simulated, session.see(0, made).simulated, rtol=1e-9)


def test_figure_is_a_picture(session):
    seen = session.see(0)
    assert figure_png(session, 0, 1, seen, seen, "Nm").startswith(b"\x89PNG")


def test_no_peak_of_a_curve_is_lost():
    plots = pytest.importorskip("axisight.explore.plots", reason="needs panel")
    time_s = np.arange(20011) * 5e-4
    values = np.sin(time_s)
    values[[7, 12345, 20010]] = 9.0, -8.0, 7.0
    values[3000:3100] = np.nan
    t, v = plots.peaks(time_s, values, 2400)
    assert 1200 < len(t) <= 2400 and (np.diff(t) > 0).all()
    assert {9.0, -8.0, 7.0} <= set(v)
    assert np.isnan(v).any()
    np.testing.assert_array_equal(v, values[np.searchsorted(time_s, t)])


def test_slider_changes_one_value(session):
    state = State(session, background(session, None))
    state.add(Effect("coulomb_friction", 1, {"coulomb_nm": 0.5, "smoothing_rad_s": 0.1}))
    state.set_value("coulomb_friction@1", "coulomb_nm", 0.7)
    (effect,) = state.version().effects
    _, *others = effect_info("coulomb_friction").parameters
    assert effect.values() == [0.7, *(p.neutral for p in others)]
    assert "0.7" in state.said_of(state.version())
    with pytest.raises(InputError):
        state.add(Effect("coulomb_friction", 7, {"coulomb_nm": 0.5}))
    assert state.version().effects == (effect,)


def test_rounding_is_no_response():
    gain = np.array([[1.0, 1e-3, 1e-17], [1e-6, 2e-13, np.nan]])
    shown = levels(gain)
    np.testing.assert_allclose(shown[:, 0], [0.0, -120.0])
    assert shown[0, 1] == pytest.approx(-60.0)
    assert np.isnan([shown[1, 1], shown[0, 2], shown[1, 2]]).all()


def test_legends_name_only_what_is_drawn():
    figure = Responses(2, ("axis1", "elbow"))
    frequency_hz = np.array([1.0, 10.0])
    figure.show({"given": (frequency_hz, np.array([[1.0, 1e-17], [0.1, 1e-17]]))})
    (legend,) = figure.figure.legend
    drawn = [item.label.value for item in legend.items if item.visible]
    assert drawn == ["axis 1", "as given"]
    assert legend.items[1].label.value == "axis 2 (elbow)"
    regard = Regard()
    regard.show("given", np.zeros(0), np.zeros(0))
    assert regard.figure.legend[0].items[0].visible is False


def test_names_are_escaped():
    bad = "<script>x</script>"
    found = said(verdict(headline=bad, verdict=bad))
    labels = [bad, bad, bad]
    pages = [text(bad), table((bad,), [(bad,)], bad, bad), of_verdict(found, labels)]
    pages += [of_cause(c) for c in found.causes]
    for page in pages:
        assert "<script" not in page
    assert "&lt;script&gt;" in of_verdict(found, labels)


class Turns:
    """A document that notes in which thread it is asked for a turn, and gives it at once."""

    def __init__(self):
        self.threads = []

    def add_next_tick_callback(self, callback):
        self.threads.append(threading.get_ident())
        callback()


def test_results_of_work_beside_come_through_the_loop():
    """A document is touched by the loop's thread alone: what another adds while it holds back is lost."""
    document, got = Turns(), []

    async def scene():
        work, done, started = Beside(document), asyncio.Event(), threading.Event()

        def take(result):
            got.append(result)
            done.set()

        def wrong():
            raise InputError("gain: expected a number")

        work.submit(threading.get_ident, take)
        await asyncio.wait_for(done.wait(), 30)
        done.clear()
        work.submit(wrong, take)
        await asyncio.wait_for(done.wait(), 30)
        # One that ends after the visit has.
        work.submit(lambda: started.set() or 1, take)
        started.wait(30)
        work.close()
        await asyncio.sleep(0.05)

    asyncio.run(scene())
    assert document.threads == [threading.get_ident()] * 2
    assert got[0] != threading.get_ident()
    assert str(got[1]) == "gain: expected a number"
    assert len(got) == 2


def test_measured_responses_are_those_of_the_machine_in_its_loop(session):
    """Axes without friction: within their standard errors, of up to three tenths, of the model's."""
    frequency_hz, gains = session.measured_gains
    model = np.abs(responses(session.robot, (), frequency_hz))
    for axis in (0, 2):
        shown = np.isfinite(gains[:, axis, axis])
        assert shown.sum() > 20
        off = np.log(gains[shown, axis, axis] / model[shown, axis, axis])
        # Half of all lie within 0.67 standard errors; windows flatten resonances and notches beside that.
        assert np.median(np.abs(off)) < 0.1
    # Noise alone goes through the controller: no gain there, which straight division would show.
    assert not np.isfinite(gains[frequency_hz > 400]).any()


def test_responses_are_not_measured_without_references(session):
    bare = [replace(log, velocity_ref_rad_s=None) for log in session.logs]
    assert measured_gains(bare) is None
    # Too few lines to tell three axes apart.
    first = session.logs[0]
    cut = {
        key: getattr(first, key)[:8]
        for key in ("time_s", "torque_nm", "position_rad", "velocity_ref_rad_s")
    }
    assert measured_gains([replace(first, **cut)]) is None
