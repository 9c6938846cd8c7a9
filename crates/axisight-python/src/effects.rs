//! The effect table and effect settings.

use axisight_core::effects::{
    BegunFrom, EFFECTS, EffectInfo, Formula, Later, Linear, ParameterInfo, Plainer, Prior,
    Resembles, SpringChange,
};
use axisight_core::robot::{EffectSetting, Place};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Place of an effect, from Python: one or two axes counted from 1, or neither for the arm.
#[derive(FromPyObject, IntoPyObject)]
pub enum AxisNumber {
    /// One axis.
    One(usize),
    /// Two axes.
    Two(usize, usize),
}

/// An effect, from Python: name, axis or axes or None, parameters in table order.
pub type EffectTuple = (String, Option<AxisNumber>, Vec<f64>);

/// Core settings with axes counted from 0. The core refuses axis 0, which stays out of range.
pub fn settings(effects: Vec<EffectTuple>) -> Vec<EffectSetting<f64>> {
    let place = |axis| match axis {
        None => Place::Arm,
        Some(AxisNumber::One(i)) => Place::Axis(usize::wrapping_sub(i, 1)),
        Some(AxisNumber::Two(i, j)) => {
            Place::Axes(usize::wrapping_sub(i, 1), usize::wrapping_sub(j, 1))
        }
    };
    let setting = |(name, axis, parameters)| EffectSetting {
        name,
        place: place(axis),
        parameters,
    };
    effects.into_iter().map(setting).collect()
}

/// A core setting, for Python.
pub fn tuple(setting: &EffectSetting<f64>) -> EffectTuple {
    let axis = match setting.place {
        Place::Arm => None,
        Place::Axis(i) => Some(AxisNumber::One(i.wrapping_add(1))),
        Place::Axes(i, j) => Some(AxisNumber::Two(i.wrapping_add(1), j.wrapping_add(1))),
    };
    (setting.name.clone(), axis, setting.parameters.clone())
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
    out.set_item("scope", word(&info.scope))?;
    out.set_item("acts", word(&info.acts))?;
    out.set_item("family", word(&info.family))?;
    out.set_item("contains", info.contains.to_vec())?;
    out.set_item("parts", info.parts.to_vec())?;
    out.set_item("usual", info.usual.to_vec())?;
    out.set_item("usual_odds", info.usual_odds)?;
    out.set_item("twins", info.twins.to_vec())?;
    out.set_item("twins_alone", info.twins_alone)?;
    relations(&out, info)?;
    let stands_for = info.stands_for.map(|s| (s.quantity, word(&s.change)));
    out.set_item("stands_for", stands_for)?;
    let linear = match info.linear {
        Linear::Waves { .. } => "waves".to_owned(),
        other => word(&other),
    };
    out.set_item("linear", linear)?;
    out.set_item("inverse_dynamics", info.inverse_dynamics)?;
    out.set_item("beside", info.beside.to_vec())?;
    out.set_item("unrepeatable", info.unrepeatable)?;
    out.set_item("needs_chain", info.needs_chain)?;
    out.set_item("absorbed_by", words(info.absorbed_by))?;
    out.set_item("shown_by", words(info.shown_by))?;
    let parameters: PyResult<Vec<_>> = info.parameters.iter().map(|p| parameter(py, p)).collect();
    out.set_item("parameters", parameters?)?;
    Ok(out)
}

fn parameter<'py>(py: Python<'py>, p: &ParameterInfo) -> PyResult<Bound<'py, PyDict>> {
    let row = PyDict::new(py);
    row.set_item("name", p.name)?;
    row.set_item("unit", p.unit)?;
    row.set_item("role", word(&p.role))?;
    row.set_item("neutral", p.neutral)?;
    row.set_item("lower", p.lower)?;
    row.set_item("upper", p.upper)?;
    row.set_item("typical", p.typical)?;
    let (prior, spread) = match p.prior {
        Prior::LogNormal { spread } => ("log_normal".to_owned(), spread),
        other => (word(&other), 0.0),
    };
    row.set_item("prior", prior)?;
    row.set_item("spread", spread)?;
    row.set_item("sizes", p.sizes)?;
    row.set_item("marks", words(p.marks))?;
    Ok(row)
}

/// Add the relations of an effect to other effects.
fn relations(out: &Bound<'_, PyDict>, info: &EffectInfo) -> PyResult<()> {
    let py = out.py();
    let resembles = info.resembles.map(|r| resembles(py, &r)).transpose()?;
    out.set_item("resembles", resembles)?;
    out.set_item(
        "plainer",
        info.plainer.map(|p| plainer(py, &p)).transpose()?,
    )?;
    let begun = info.begun_from.map(|b| begun_from(py, &b)).transpose()?;
    out.set_item("begun_from", begun)?;
    out.set_item("later", info.later.map(|l| later(py, &l)).transpose()?)?;
    out.set_item("law_of", info.law_of.map(|l| word(&l)))?;
    out.set_item("formula", formula(py, &info.formula)?)?;
    out.set_item("spring", info.spring.map(|s| spring(py, &s)).transpose()?)?;
    out.set_item("scales", info.scales.map(|s| word(&s)))
}

fn resembles<'py>(py: Python<'py>, r: &Resembles) -> PyResult<Bound<'py, PyDict>> {
    let row = PyDict::new(py);
    row.set_item("law", r.law)?;
    row.set_item("size", r.size)?;
    row.set_item("ratio", r.ratio)?;
    row.set_item("shape", r.shape.to_vec())?;
    row.set_item("rarer", r.rarer)?;
    Ok(row)
}

fn plainer<'py>(py: Python<'py>, p: &Plainer) -> PyResult<Bound<'py, PyDict>> {
    let row = PyDict::new(py);
    row.set_item("law", p.law)?;
    row.set_item("adds", p.adds.to_vec())?;
    row.set_item("likelier", p.likelier)?;
    row.set_item("shown", word(&p.shown))?;
    Ok(row)
}

fn begun_from<'py>(py: Python<'py>, b: &BegunFrom) -> PyResult<Bound<'py, PyDict>> {
    let row = PyDict::new(py);
    row.set_item("law", b.law)?;
    row.set_item("takes", b.takes.to_vec())?;
    Ok(row)
}

fn later<'py>(py: Python<'py>, l: &Later) -> PyResult<Bound<'py, PyDict>> {
    let row = PyDict::new(py);
    row.set_item("amplitude", l.amplitude)?;
    row.set_item("begin", l.begin)?;
    row.set_item("most", l.most)?;
    row.set_item("shape", l.shape)?;
    row.set_item("as_of", l.as_of)?;
    Ok(row)
}

fn formula<'py>(py: Python<'py>, f: &Formula) -> PyResult<Bound<'py, PyDict>> {
    let row = PyDict::new(py);
    row.set_item("kind", f.kind.map(|kind| word(&kind)))?;
    row.set_item("error", f.error)?;
    row.set_item("held", word(&f.held))?;
    row.set_item("white", f.white)?;
    row.set_item("value_error", f.value_error)?;
    row.set_item("of_each", f.of_each)?;
    Ok(row)
}

fn spring<'py>(py: Python<'py>, s: &SpringChange) -> PyResult<Bound<'py, PyDict>> {
    let row = PyDict::new(py);
    let sums: Vec<_> = s.sums.iter().map(|names| names.to_vec()).collect();
    row.set_item("sums", sums)?;
    row.set_item("without_middle", s.without_middle)?;
    Ok(row)
}

/// A variant without fields as a Python word: `TorquePath` becomes `torque_path`.
fn word(variant: &impl std::fmt::Debug) -> String {
    let mut out = String::new();
    for c in format!("{variant:?}").chars() {
        if c.is_ascii_uppercase() && !out.is_empty() {
            out.push('_');
        }
        out.push(c.to_ascii_lowercase());
    }
    out
}

fn words(variants: &[impl std::fmt::Debug]) -> Vec<String> {
    variants.iter().map(word).collect()
}
