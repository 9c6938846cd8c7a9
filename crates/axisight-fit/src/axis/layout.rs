//! Structure of an axis model, and the places of its parameters.

use super::error::AxisError;

/// Largest number of masses of a chain.
pub const MOST_MASSES: usize = 4;

/// The measured output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Output {
    /// Motor velocity.
    Velocity,
    /// Backward difference of the motor position, zero at the first sample.
    VelocityDifference,
    /// Motor position.
    Position,
}

/// The course of the motor torque between samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hold {
    /// Constant.
    Zero,
    /// Linear from sample to sample.
    First,
}

/// Structure of the model of one axis.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisModel {
    /// Number of masses, including the motor.
    pub masses: usize,
    /// Measured output.
    pub output: Output,
    /// Course of the torque between samples.
    pub hold: Hold,
    /// Half width of the smoothed sign of the Coulomb friction [rad/s]; zero for an exact sign.
    pub smoothing: f64,
    /// Orders of the torque ripple over the motor angle.
    pub ripple_orders: Vec<f64>,
    /// Runge-Kutta steps per sample.
    pub substeps: usize,
}

/// Places of the parameters in the vector of all parameters.
///
/// The order is `J_1..J_n | k1_1.. | k3_1.. | d_1.. | F_v, F_c, r, b, F_s, v_s, F_a, offset |
/// ripple (cos, sin).. | gains of the deflections, then of the speeds`, and for each data set its
/// start `phi, deflections, speeds`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Number of masses.
    pub masses: usize,
    /// Number of ripple orders.
    pub orders: usize,
}

impl Layout {
    fn springs(self) -> usize {
        self.masses.saturating_sub(1)
    }
    /// Place of the inertia of mass `i`; the motor is the first.
    pub fn inertia(self, i: usize) -> usize {
        i
    }
    /// Place of the linear stiffness of spring `i`; the gear is the first.
    pub fn linear(self, i: usize) -> usize {
        self.masses + i
    }
    /// Place of the cubic stiffness of spring `i`.
    pub fn cubic(self, i: usize) -> usize {
        self.linear(0) + self.springs() + i
    }
    /// Place of the damping of spring `i`.
    pub fn damping(self, i: usize) -> usize {
        self.cubic(0) + self.springs() + i
    }
    /// Place of the viscous friction.
    pub fn viscous(self) -> usize {
        self.damping(0) + self.springs()
    }
    /// Place of the Coulomb friction.
    pub fn coulomb(self) -> usize {
        self.viscous() + 1
    }
    /// Place of the gear ratio.
    pub fn ratio(self) -> usize {
        self.viscous() + 2
    }
    /// Place of the half width of the backlash.
    pub fn backlash(self) -> usize {
        self.viscous() + 3
    }
    /// Place of the excess of friction at standstill over the Coulomb friction.
    pub fn excess(self) -> usize {
        self.viscous() + 4
    }
    /// Place of the speed at which the excess has fallen to 1/e.
    pub fn stribeck_speed(self) -> usize {
        self.viscous() + 5
    }
    /// Place of the viscous friction in proportion to the absolute speed.
    pub fn asymmetry(self) -> usize {
        self.viscous() + 6
    }
    /// Place of the constant motor torque.
    pub fn offset(self) -> usize {
        self.viscous() + 7
    }
    /// Place of the cosine amplitude of ripple order `i`; the sine follows.
    pub fn ripple(self, i: usize) -> usize {
        self.viscous() + 8 + 2 * i
    }
    /// Place of the innovations gain of state `i`: deflections, then speeds.
    pub fn gain(self, i: usize) -> usize {
        self.ripple(self.orders) + i
    }
    /// Number of gains, which is the number of states without the motor angle.
    pub fn gains(self) -> usize {
        2 * self.masses - 1
    }
    /// Number of parameters that all data sets share.
    pub fn shared(self) -> usize {
        self.gain(0) + self.gains()
    }
    /// Number of entries of a start: motor angle, deflections, speeds.
    pub fn states(self) -> usize {
        2 * self.masses
    }
    /// Place of the first entry of the start of data set `set`.
    pub fn start(self, set: usize) -> usize {
        self.shared() + set * self.states()
    }
    /// Number of parameters with `sets` data sets.
    pub fn len(self, sets: usize) -> usize {
        self.start(sets)
    }
}

impl AxisModel {
    /// Places of the parameters of this model.
    pub fn layout(&self) -> Layout {
        Layout {
            masses: self.masses,
            orders: self.ripple_orders.len(),
        }
    }

    /// Check the structure of the model.
    ///
    /// # Errors
    /// [`AxisError::Invalid`] that names the invalid field.
    pub fn check(&self) -> Result<(), AxisError> {
        if !(2..=MOST_MASSES).contains(&self.masses) {
            let wanted = format!("2 to {MOST_MASSES}");
            return Err(AxisError::invalid("masses", wanted, self.masses));
        }
        if !(self.smoothing >= 0.0 && self.smoothing.is_finite()) {
            return Err(AxisError::invalid(
                "smoothing",
                "a finite number from 0",
                self.smoothing,
            ));
        }
        if self.substeps == 0 {
            return Err(AxisError::invalid("substeps", "at least 1", 0));
        }
        match self.ripple_orders.iter().find(|n| !n.is_finite()) {
            Some(n) => Err(AxisError::invalid("ripple_orders", "finite numbers", n)),
            None => Ok(()),
        }
    }

    /// Whether the parameters `theta`, of which `free` may move, need the extended equations. The
    /// plain ones have inertias, springs, dampers, viscous and Coulomb friction only.
    pub(super) fn extended(&self, theta: &[f64], free: &[usize]) -> bool {
        let layout = self.layout();
        let special = [
            layout.backlash(),
            layout.excess(),
            layout.asymmetry(),
            layout.offset(),
        ];
        let present = special
            .iter()
            .any(|i| free.contains(i) || theta.get(*i).is_some_and(|x| *x != 0.0));
        present
            || free.contains(&layout.ratio())
            || !self.ripple_orders.is_empty()
            || self.output != Output::Velocity
    }
}
