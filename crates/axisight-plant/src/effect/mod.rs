//! Effects: their description, the points where they may act, and errors in their use.

mod error;
mod formula;
mod info;
mod kernel;
mod prior;
mod relations;

pub use error::EffectError;
pub use formula::{Formula, FormulaKind, Held};
pub use info::{
    Absorber, Acts, Change, EffectInfo, Experiment, Family, Linear, Mark, ParameterInfo, Role,
    Scope, StandsFor,
};
pub use kernel::{
    Arm, AxisTorque, BaseJoint, CoupledAxis, Deflected, GearError, Joint, Kernel, Motor, Pair,
    PlantParameters, Spring,
};
pub use prior::Prior;
pub use relations::{BegunFrom, Later, LawOf, Plainer, Resembles, Scales, Shown, SpringChange};
