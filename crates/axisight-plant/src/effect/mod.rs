//! What an effect is: what is known of it, the points where it may act, how it is misused.

mod error;
mod info;
mod kernel;

pub use error::EffectError;
pub use info::{
    Absorber, Acts, Change, EffectInfo, Experiment, Family, Linear, ParameterInfo, Role, Scope,
    StandsFor,
};
pub use kernel::{
    Arm, AxisTorque, BaseJoint, CoupledAxis, Deflected, GearError, Joint, Kernel, Motor, Pair,
    PlantParameters, Spring,
};
