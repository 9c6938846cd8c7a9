//! The torque regressor of a chain, linear in its inertial parameters (thesis (4.2)).
