"""Layouts beside the signals of a diagnosis: they name what the recording has, and begin with the largest gap."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
import xarray as xr
from mcap.reader import make_reader
from rosbags.typesys import Stores, get_typestore

from axisight import signal_files
from axisight.errors import InputError
from axisight.palette import contrast
from axisight.signal_files.first_view import first_view
from axisight.signal_files.plots import MEASURED

JOINTS, UNITS = ["shoulder", "rail", "wrist"], ["Nm", "N", "Nm"]
TIME = 0.01 * np.arange(300)
# Axis 2 is furthest off, on the log "held 2", for half a second from here on.
OFF_FROM_S = 1.7

# What Lichtblick, the open continuation of Foxglove Studio, reads: the types LayoutData
# (context/CurrentLayoutContext/actions.ts), TabPanelConfig (types/layouts.ts), PlotConfig and PlotPath
# (panels/Plot/utils/config.ts), and MosaicNode of react-mosaic-component.
PATH = {
    "type": "object",
    "required": ["value", "enabled", "timestampMethod"],
    "additionalProperties": False,
    "properties": {
        "value": {"type": "string"},
        "enabled": {"type": "boolean"},
        "timestampMethod": {"enum": ["receiveTime", "headerStamp"]},
        "label": {"type": "string"},
        "color": {"type": "string", "pattern": "^#[0-9a-f]{6}$"},
        "showLine": {"type": "boolean"},
        "lineSize": {"type": "number"},
    },
}
PLOT = {
    "type": "object",
    "required": [
        "paths",
        "showLegend",
        "legendDisplay",
        "showPlotValuesInLegend",
        "showXAxisLabels",
        "showYAxisLabels",
        "isSynced",
        "xAxisVal",
        "sidebarDimension",
    ],
    "additionalProperties": False,
    "properties": {
        "paths": {"type": "array", "items": PATH},
        "minXValue": {"type": "number"},
        "maxXValue": {"type": "number"},
        "showLegend": {"type": "boolean"},
        "legendDisplay": {"enum": ["floating", "top", "left", "none"]},
        "showPlotValuesInLegend": {"type": "boolean"},
        "showXAxisLabels": {"type": "boolean"},
        "showYAxisLabels": {"type": "boolean"},
        "isSynced": {"type": "boolean"},
        "xAxisVal": {"enum": ["timestamp", "index", "custom", "currentCustom"]},
        "sidebarDimension": {"type": "number"},
        "foxglovePanelTitle": {"type": "string"},
        "lichtblickPanelTitle": {"type": "string"},
    },
}
LAYOUT = {
    "$defs": {
        "node": {
            "oneOf": [
                {"type": "string"},
                {
                    "type": "object",
                    "required": ["direction", "first", "second"],
                    "additionalProperties": False,
                    "properties": {
                        "direction": {"enum": ["row", "column"]},
                        "first": {"$ref": "#/$defs/node"},
                        "second": {"$ref": "#/$defs/node"},
                        "splitPercentage": {
                            "type": "number",
                            "exclusiveMinimum": 0,
                            "exclusiveMaximum": 100,
                        },
                    },
                },
            ]
        },
        "tabs": {
            "type": "object",
            "required": ["activeTabIdx", "tabs"],
            "additionalProperties": False,
            "properties": {
                "activeTabIdx": {"type": "integer"},
                "tabs": {
                    "type": "array",
                    "items": {
                        "type": "object",
                        "required": ["title", "layout"],
                        "additionalProperties": False,
                        "properties": {
                            "title": {"type": "string"},
                            "layout": {"$ref": "#/$defs/node"},
                        },
                    },
                },
            },
        },
    },
    "type": "object",
    "required": ["configById", "globalVariables", "userNodes", "playbackConfig", "layout"],
    "additionalProperties": False,
    "properties": {
        "configById": {
            "type": "object",
            "additionalProperties": False,
            # The type of a panel stands before the mark.
            "patternProperties": {"^Plot![^!]+$": PLOT, "^Tab![^!]+$": {"$ref": "#/$defs/tabs"}},
        },
        "globalVariables": {"type": "object", "maxProperties": 0},
        "userNodes": {"type": "object", "maxProperties": 0},
        "playbackConfig": {
            "type": "object",
            "required": ["speed"],
            "additionalProperties": False,
            "properties": {"speed": {"type": "number"}},
        },
        "layout": {"$ref": "#/$defs/node"},
    },
}


def log(
    name: str, role: str, *, off: float = 0.0, positions: bool = True, seed: int = 0
) -> xr.Dataset:
    """Signals of a log whose simulator is off by a little, and by ``off`` on axis 2 for half a second."""
    random = np.random.default_rng(seed)
    measured = random.normal(size=(len(TIME), 3))
    residual = np.full_like(measured, 0.01)
    residual[(OFF_FROM_S <= TIME) & (TIME < OFF_FROM_S + 0.5), 1] += off
    arrays = {
        "measured_torque_nm": measured,
        "simulated_before_torque_nm": measured + residual,
        "simulated_after_torque_nm": measured,
        "residual_before_torque_nm": residual,
        "residual_after_torque_nm": 0 * measured,
        "measured_position_rad": random.normal(size=measured.shape),
    }
    if positions:
        for stage in ("before", "after"):
            arrays[f"simulated_{stage}_position_rad"] = random.normal(size=measured.shape)
    return xr.Dataset(
        {key: (("time_s", "axis"), x, {"long_name": key}) for key, x in arrays.items()},
        coords={
            "time_s": TIME,
            "axis": [1, 2, 3],
            "joint": ("axis", JOINTS),
            "unit": ("axis", UNITS),
            "gap_before": ("axis", [0.1, 0.7, 0.2]),
        },
        attrs={"log": name, "role": role, "mode": "closed_loop"},
    )


SIGNALS = (
    log("fit", "estimation", off=9.0),
    log("fit again", "estimation", seed=1),
    log("held", "validation", off=0.5, seed=2),
    log("held 2", "validation", off=1.0, seed=3),
)


def leaves(node: Any) -> Iterator[str]:
    """Return the panels of a tree, tabs and their content too."""
    if isinstance(node, str):
        yield node
    else:
        yield from leaves(node["first"])
        yield from leaves(node["second"])


def paths(panel: dict[str, Any]) -> list[str]:
    return [path["value"] for path in panel["paths"]]


def written(folder: Path, signals: tuple[xr.Dataset, ...] = SIGNALS) -> tuple[Path, dict[str, Any]]:
    file = signal_files.write_signals(signals, folder / "out.mcap")
    return file, json.loads((folder / "out.foxglove.json").read_text(encoding="utf-8"))


def first_messages(file: Path) -> dict[str, Any]:
    """Return the first joint states of each topic, as the package of the format reads them."""
    types = get_typestore(Stores.ROS2_HUMBLE)
    found: dict[str, Any] = {}
    with file.open("rb") as stream:
        for schema, channel, message in make_reader(stream).iter_messages():
            if channel.topic not in found and schema.name == "sensor_msgs/msg/JointState":
                found[channel.topic] = types.deserialize_cdr(message.data, schema.name)
    return found


@pytest.mark.parametrize("positions", [True, False])
def test_a_layout_names_what_the_recording_has(tmp_path: Path, positions: bool):
    signals = tuple(
        log(s.attrs["log"], s.attrs["role"], positions=positions, seed=k)
        for k, s in enumerate(SIGNALS)
    )
    file, layout = written(tmp_path, signals)
    messages = first_messages(file)
    named = set()
    for panel in layout["configById"].values():
        for path in paths(panel) if "paths" in panel else []:
            topic, field, axis = re.fullmatch(r"(.+)\.(\w+)\[(\d)\]", path).groups()
            assert np.isfinite(getattr(messages[topic], field)[int(axis)]), path
            named.add((topic, field, int(axis)))
    # Every number of every message is in some plot.
    assert named == {
        (topic, field, axis)
        for topic, message in messages.items()
        for field in ("effort", "position")
        for axis in range(len(getattr(message, field)))
    }
    simulated = messages["/validation/held/simulated_before"]
    assert len(simulated.position) == (3 if positions else 0)
    np.testing.assert_array_equal(
        messages["/validation/held/measured"].position,
        signals[2]["measured_position_rad"].values[0],
    )


def test_a_layout_is_what_foxglove_reads(tmp_path: Path):
    _, layout = written(tmp_path)
    jsonschema.Draft202012Validator.check_schema(LAYOUT)
    jsonschema.validate(layout, LAYOUT)
    panels = layout["configById"]
    shown = list(leaves(layout["layout"]))
    for tab in panels[shown[0]]["tabs"]:
        shown += leaves(tab["layout"])
    # A panel can stand in one place only.
    assert sorted(shown) == sorted(panels)


def test_every_axis_of_every_log_has_its_plots(tmp_path: Path):
    _, layout = written(tmp_path)
    panels = layout["configById"]
    tabs = panels[layout["layout"]]["tabs"]
    assert [tab["title"] for tab in tabs] == [
        "Largest gap: rail in held 2",
        "held 2 (validation)",
        "held (validation)",
        "fit (estimation)",
        "fit again (estimation)",
    ]
    for tab in tabs[1:]:
        titles = [panels[name]["foxglovePanelTitle"] for name in leaves(tab["layout"])]
        assert titles == [
            "shoulder: torque [Nm]",
            "shoulder: simulated less measured torque [Nm]",
            "shoulder: motor angle [rad]",
            "rail: force [N]",
            "rail: simulated less measured force [N]",
            "rail: motor position [m]",
            "wrist: torque [Nm]",
            "wrist: simulated less measured torque [Nm]",
            "wrist: motor angle [rad]",
        ]
    torque = paths(panels[next(leaves(tabs[2]["layout"]))])
    assert torque == [
        f"/validation/held/{name}.effort[0]"
        for name in ("measured", "simulated_before", "simulated_after")
    ]


def test_the_largest_gap_is_in_front(tmp_path: Path):
    _, layout = written(tmp_path)
    panels = layout["configById"]
    root = panels[layout["layout"]]
    front = [panels[name] for name in leaves(root["tabs"][root["activeTabIdx"]]["layout"])]
    assert [len(panel["paths"]) for panel in front] == [3, 2, 3]
    assert all(
        re.match(r"/validation/held_2/\w+\.\w+\[1\]", path) for p in front for path in paths(p)
    )
    for panel in front:
        # The window of a tenth of the log, 0.3 s, lies within the half second that is off. The recording
        # begins with the time 0 of the logs, so that the plots show the time of the log.
        assert OFF_FROM_S <= panel["minXValue"] < panel["maxXValue"] < OFF_FROM_S + 0.5
        assert panel["maxXValue"] - panel["minXValue"] == pytest.approx(0.29)
        assert not panel["isSynced"]
    others = [p for p in panels.values() if "paths" in p and p not in front]
    assert all(panel["isSynced"] and "minXValue" not in panel for panel in others)


def test_the_first_view_is_that_of_the_verdict():
    # A log that held an estimation counts only where no log was held back.
    assert first_view(SIGNALS).log == 3
    assert first_view(SIGNALS[:2]).log == 0
    # An axis without a gap: there the simulation broke off.
    broken = SIGNALS[3].assign_coords(gap_before=("axis", [0.1, 0.7, np.nan]))
    broken["residual_before_torque_nm"] = broken["residual_before_torque_nm"].copy()
    broken["residual_before_torque_nm"][100:, 2] = np.nan
    broken["residual_before_torque_nm"][60:100, 2] = 2.0
    found = first_view([broken, *SIGNALS[:3]])
    assert (found.log, found.axis) == (0, 2)
    assert 0.6 <= found.start_s < found.stop_s <= 0.99
    # Logs with few samples and an axis whose torque is constant.
    short = SIGNALS[2].isel(time_s=slice(0, 2))
    short["measured_torque_nm"] = 0 * short["measured_torque_nm"]
    assert first_view([short]).stop_s == TIME[1]


def test_curves_can_be_seen_on_light_and_dark():
    # WCAG 2 asks for 3:1 of the parts of figures.
    assert min(contrast(MEASURED, ground) for ground in ("#ffffff", "#1c1c1c")) > 3


def test_a_layout_replaces_only_what_may_be_replaced(tmp_path: Path):
    (tmp_path / "out.foxglove.json").write_text("mine")
    with pytest.raises(InputError, match=r"out\.foxglove\.json exists"):
        signal_files.write_signals(SIGNALS, tmp_path / "out.mcap")
    assert not (tmp_path / "out.mcap").exists()
    signal_files.write_signals(SIGNALS, tmp_path / "out.mcap", overwrite=True)
    assert signal_files.files_of(tmp_path / "out.mcap")[1].read_text().startswith("{")
    assert signal_files.files_of(tmp_path / "out.rrd") == [tmp_path / "out.rrd"]


def columns(store: Any) -> dict[str, dict[str, list[Any]]]:
    """Return the rows of each entity by column."""
    found: dict[str, dict[str, list[Any]]] = {}
    for chunk in store.stream():
        batch = chunk.to_record_batch()
        rows = {name: batch.column(name).to_pylist() for name in batch.schema.names}
        found.setdefault(chunk.entity_path, {}).update(rows)
    return found


def test_rerun_reads_signals_and_blueprint(tmp_path: Path):
    pytest.importorskip("rerun", reason="axisight[rerun]")
    from rerun.chunk import RrdReader  # noqa: PLC0415

    reader = RrdReader(signal_files.write_signals(SIGNALS, tmp_path / "out.rrd"))
    data = columns(reader.store())
    # Warnings of the library would stand there.
    assert not [path for path in data if "warning" in path]
    about = json.loads(data["/axisight"]["TextDocument:text"][0][0])
    assert about["joints"] == JOINTS
    held = data["/validation/held/axis_2/torque/measured"]
    values = SIGNALS[2]["measured_torque_nm"].values[:, 1]
    np.testing.assert_array_equal(np.ravel(held["Scalars:scalars"]), values)
    seconds = [time.total_seconds() for time in held["time"]]
    np.testing.assert_allclose(seconds, TIME, rtol=0, atol=1e-6)

    panels = columns(reader.store(store=reader.blueprints()[0]))
    views = {p: q["ViewContents:query"][0] for p, q in panels.items() if p.endswith("ViewContents")}
    curves = {path for path, rows in data.items() if "Scalars:scalars" in rows}
    assert {path for query in views.values() for path in query} == curves
    # Of each axis of each log: three torques, two residuals, three positions.
    assert len(curves) == len(SIGNALS) * 3 * 8

    def part(path: str, key: str) -> Any:
        return panels[f"/{path}"].get(f"ContainerBlueprint:{key}", [[None]])[0]

    (root,) = (p[1:] for p, rows in panels.items() if "ContainerBlueprint:active_tab" in rows)
    tabs = part(root, "contents")
    assert part(root, "active_tab") == tabs[:1]
    assert [part(tab, "display_name")[0] for tab in tabs] == [
        "Largest gap: rail in held 2",
        "held 2 (validation)",
        "held (validation)",
        "fit (estimation)",
        "fit again (estimation)",
    ]
    for tab in tabs[1:]:
        assert [part(row, "display_name")[0] for row in part(tab, "contents")] == JOINTS
    first = part(tabs[0], "contents")
    assert views[f"/{first[0]}/ViewContents"] == [
        f"/validation/held_2/axis_2/torque/{name}"
        for name in ("measured", "simulated_before", "simulated_after")
    ]
    (range_,) = panels[f"/{first[0]}/TimeAxis"]["TimeAxis:view_range"][0]
    start, stop = (range_[edge] for edge in ("start", "end"))
    assert OFF_FROM_S * 1e9 <= start < stop < (OFF_FROM_S + 0.5) * 1e9
