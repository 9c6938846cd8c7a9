//! The effect table and effect settings.

use axisight_core::effects::{Acts, EFFECTS, EffectInfo, Role, Scope};
use axisight_core::robot::EffectSetting;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// An effect as Python hands it over: name, 1-based axis or None, parameters in table order.
pub type EffectTuple = (String, Option<usize>, Vec<f64>);

/// Core settings; axes become 0-based (axis 0 stays out of range and is refused by the core).
pub fn settings(effects: Vec<EffectTuple>) -> Vec<EffectSetting<f64>> {
    effects
        .into_iter()
        .map(|(name, axis, parameters)| EffectSetting {
            name,
            axis: axis.map(|a| a.wrapping_sub(1)),
            parameters,
        })
        .collect()
}

/// Every effect with its description and parameters, as plain dictionaries.
#[pyfunction]
pub fn effect_table(py: Python<'_>) -> PyResult<Vec<Bound<'_, PyDict>>> {
    EFFECTS.iter().map(|info| describe(py, info)).collect()
}

fn describe<'py>(py: Python<'py>, info: &EffectInfo) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    out.set_item("name", info.name)?;
    out.set_item("summary", info.summary)?;
    out.set_item("equation", info.equation)?;
    out.set_item("source", info.source)?;
    out.set_item(
        "scope",
        if info.scope == Scope::Axis {
            "axis"
        } else {
            "arm"
        },
    )?;
    let acts = match info.acts {
        Acts::TorquePath => "torque_path",
        Acts::Motor => "motor",
        Acts::Transmission => "transmission",
        Acts::Joint => "joint",
        Acts::Arm => "arm",
        Acts::Sensor => "sensor",
    };
    out.set_item("acts", acts)?;
    let mut parameters = Vec::new();
    for p in info.parameters {
        let row = PyDict::new(py);
        row.set_item("name", p.name)?;
        row.set_item("unit", p.unit)?;
        row.set_item(
            "role",
            if p.role == Role::Amplitude {
                "amplitude"
            } else {
                "shape"
            },
        )?;
        row.set_item("neutral", p.neutral)?;
        row.set_item("lower", p.lower)?;
        row.set_item("upper", p.upper)?;
        row.set_item("typical", p.typical)?;
        parameters.push(row);
    }
    out.set_item("parameters", parameters)?;
    Ok(out)
}
