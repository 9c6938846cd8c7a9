"""The explorer: from a slider's move to the new curve, 10 s of three axes at 2 kHz.

    python benches/explore.py [--browser] [--moves 60]

Prints milliseconds, median and 95 %: of the simulation alone, of what the page asks for (simulation, gap by
axis and band, thinned curves), and with --browser from the value of a slider to the curve's data in Chromium.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import numpy as np

from axisight import Effect, load_robot, simulate
from axisight.blind.case_files import CaseFolder, moves
from axisight.explore.answers import answer
from axisight.explore.plots import peaks
from axisight.explore.session import Session, Version
from axisight.logs import read_case

SECONDS, RATE_HZ = 10.0, 2000.0


def write_case(folder: Path) -> Path:
    """Three logs of a machine with Coulomb friction that its simulator lacks."""
    robot = load_robot("irb6600_like")
    time_s = np.arange(int(SECONDS * RATE_HZ)) / RATE_HZ
    tops = {"a": [50.0, 40.0, -45.0], "b": [-40.0, 30.0, 50.0], "held": [45.0, -35.0, 40.0]}
    case = CaseFolder(folder, "bench")
    for run, (name, top) in enumerate(tops.items()):
        reference = moves(time_s, SECONDS, np.array(top))
        friction = Effect("coulomb_friction", 2, {"coulomb_nm": 0.6})
        found = simulate(robot, reference, effects=[friction], noise_seed=1, run=run)
        torque, angle = found["torque_cmd_nm"].values, found["position_rad"].values
        role = "validation" if name == "held" else "estimation"
        case.add(name, role, time_s, reference, torque, angle)
    case.finish("irb6600_like")
    return folder


def spread(label: str, took_s: list[float], cpu_s: list[float] | None = None) -> None:
    middle, high = 1e3 * np.quantile(took_s, [0.5, 0.95])
    cpu = "" if cpu_s is None else f", CPU median {1e3 * np.median(cpu_s):.0f} ms"
    print(f"{label:38s} median {middle:5.0f} ms, 95 % {high:5.0f} ms{cpu}, n = {len(took_s)}")


def timed(work: Callable[[float], object], moves_: int) -> tuple[list[float], list[float]]:
    """Return seconds by the clock and of CPU, which other work on the machine hardly changes."""
    took, cpu = [], []
    for i in range(moves_ + 3):
        start = time.perf_counter(), time.process_time()
        work(0.01 * (i + 1))
        took.append(time.perf_counter() - start[0])
        cpu.append(time.process_time() - start[1])
    return took[3:], cpu[3:]


def on_server(folder: Path, moves_: int) -> None:
    case = read_case(folder)
    first = case.estimation[0]
    session = Session("bench", load_robot(case.robot_path), case.estimation, case.validation)

    def version(value: float) -> Version:
        return Version.of([Effect("coulomb_friction", 2, {"coulomb_nm": value})])

    def asked(value: float) -> None:
        found = answer(session, 0, version(value), {})
        for values in (found.now.simulated, found.now.residual, found.now.position_rad):
            assert values is not None
            peaks(first.time_s, values[:, 1], 2400)

    spread("simulation", *timed(lambda x: session.view.run(version(x).variant(), first), moves_))
    # Other values: none is remembered.
    spread("answer with gaps and curves", *timed(lambda x: asked(x + 1e-4), moves_))


MOVED = """async value => {
  const doc = Bokeh.documents[0];
  const sliders = doc._all_models ? [...doc._all_models.values()] : [];
  const slider = sliders.find(m => m.type == "Slider" || m.type.endsWith("EditableSlider")) ||
    sliders.find(m => /Slider$/.test(m.type));
  const source = doc.get_model_by_name("torque-now");
  const start = performance.now();
  const changed = new Promise(done => {
    const slot = () => { source.properties.data.change.disconnect(slot); done(performance.now()); };
    source.properties.data.change.connect(slot);
  });
  slider.value = value;
  return (await changed) - start;
}"""


def in_browser(folder: Path, moves_: int) -> None:
    # Needs playwright, which the rest does not.
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "python"))
    driver = import_module("explorer")
    with driver.explorer(folder) as running, driver.visit(running.url) as seen:
        seen.choose("cause", "Coulomb friction")
        seen.choose("where", "axis 2")
        seen.click("add")
        seen.page.get_by_role("button", name="take it out").wait_for()
        took = []
        for i in range(moves_ + 3):
            # What is slow, the gap of all validation logs, has come by then.
            seen.page.wait_for_timeout(1000)
            took.append(seen.page.evaluate(MOVED, 0.0125 * (i + 1)) / 1e3)
        spread("in Chromium, slider to curve", took[3:])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--moves", type=int, default=60)
    parser.add_argument("--browser", action="store_true")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        case = write_case(Path(folder) / "case")
        on_server(case, given.moves)
        if given.browser:
            in_browser(case, given.moves)


if __name__ == "__main__":
    main()
