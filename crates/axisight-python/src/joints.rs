//! Descriptions of joints, as Python sees them.

use axisight_core::robot::{Joint, Motion};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Description of a joint, with the changes made since.
pub fn joint_entry<'py>(py: Python<'py>, joint: &Joint) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    out.set_item("name", &joint.name)?;
    out.set_item("parent", joint.parent)?;
    out.set_item("prismatic", joint.motion == Motion::Prismatic)?;
    out.set_item("origin", joint.origin)?;
    out.set_item("axis", joint.axis)?;
    let spring = joint.compliance.as_ref();
    out.set_item("spring", spring.map(|s| (s.stiffness, s.damping)))?;
    let link = joint.link.as_ref();
    out.set_item("link", link.map(|l| (l.mass, l.com, l.inertia)))?;
    let drive = joint.drive.as_ref();
    let drive = drive.map(|d| (d.gear_ratio, d.motor_inertia, d.viscous_friction));
    out.set_item("drive", drive)?;
    Ok(out)
}
