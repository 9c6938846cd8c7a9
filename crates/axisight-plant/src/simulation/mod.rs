//! Sampled-data simulation: the controller acts at the sample time, the plant moves in between.

mod beside;
mod closed_loop;
mod controller;
mod current_loop;
mod dormand_prince;
mod implicit;
mod known_robot;
mod lanes;
mod late_reading;
mod late_target;
mod method;
mod nystrom4;
mod runge_kutta4;
mod sensing;
mod torque_path;

pub use beside::{Beside, Moment};
pub use closed_loop::{
    Drive, Run, Sample, Signals, SimulationError, Status, check, simulate, simulate_beside,
};
pub use controller::{ControlLoop, OwnLaw};
pub use lanes::lane_value;
pub use method::{CourseOfAnother, Effort, Method, Stepper, stable_substeps};
pub use torque_path::{Line, SampleTorque, TorqueBuffers, TorquePath};
