//! The structure of a model and the place of each of its parameters.

use super::error::AxisError;

/// Most masses of a chain.
pub const MOST_MASSES: usize = 4;

/// What is measured at the samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Output {
    /// Motor velocity.
    Velocity,
    /// Backward difference of the motor position, zero at the first sample.
    VelocityDifference,
    /// Motor position.
    Position,
}

/// The motor torque between samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hold {
    /// Held.
    Zero,
    /// Straight from one sample to the next.
    First,
}

/// Structure of the model of one axis.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisModel {
    /// Masses, the motor included.
    pub masses: usize,
    /// What is measured.
    pub output: Output,
    /// Torque between samples.
    pub hold: Hold,
    /// Half width of the smoothed sign of the Coulomb friction [rad/s]; zero for the sign itself.
    pub smoothing: f64,
    /// Orders of the torque ripple in the motor angle.
    pub ripple_orders: Vec<f64>,
    /// Runge-Kutta steps per sample.
    pub substeps: usize,
}

/// Where each parameter stands in the vector of all.
///
/// `J_1..J_n | k1_1.. | k3_1.. | d_1.. | F_v, F_c, r, b, F_s, v_s, F_a, offset |
/// ripple (cos, sin).. | gains of the deflections, then of the speeds`, and for each data set
/// its start `phi, deflections, speeds`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Masses.
    pub masses: usize,
    /// Orders of ripple.
    pub orders: usize,
}

impl Layout {
    fn springs(self) -> usize {
        self.masses.saturating_sub(1)
    }
    /// Inertia of mass `i`, the motor first.
    pub fn inertia(self, i: usize) -> usize {
        i
    }
    /// Linear stiffness of spring `i`, the gear first.
    pub fn linear(self, i: usize) -> usize {
        self.masses + i
    }
    /// Cubic stiffness of spring `i`.
    pub fn cubic(self, i: usize) -> usize {
        self.linear(0) + self.springs() + i
    }
    /// Damping of spring `i`.
    pub fn damping(self, i: usize) -> usize {
        self.cubic(0) + self.springs() + i
    }
    /// Viscous friction.
    pub fn viscous(self) -> usize {
        self.damping(0) + self.springs()
    }
    /// Coulomb friction.
    pub fn coulomb(self) -> usize {
        self.viscous() + 1
    }
    /// Gear ratio.
    pub fn ratio(self) -> usize {
        self.viscous() + 2
    }
    /// Half width of the backlash.
    pub fn backlash(self) -> usize {
        self.viscous() + 3
    }
    /// Excess of the friction at standstill over the Coulomb friction.
    pub fn excess(self) -> usize {
        self.viscous() + 4
    }
    /// Speed at which the excess has fallen to 1/e.
    pub fn stribeck_speed(self) -> usize {
        self.viscous() + 5
    }
    /// Viscous friction of the size of the speed.
    pub fn asymmetry(self) -> usize {
        self.viscous() + 6
    }
    /// Constant motor torque.
    pub fn offset(self) -> usize {
        self.viscous() + 7
    }
    /// Cosine amplitude of ripple order `i`; the sine follows.
    pub fn ripple(self, i: usize) -> usize {
        self.viscous() + 8 + 2 * i
    }
    /// Innovations gain of state `i`: deflections, then speeds.
    pub fn gain(self, i: usize) -> usize {
        self.ripple(self.orders) + i
    }
    /// Number of gains: states without the motor angle.
    pub fn gains(self) -> usize {
        2 * self.masses - 1
    }
    /// Number of parameters that all data sets share.
    pub fn shared(self) -> usize {
        self.gain(0) + self.gains()
    }
    /// Entries of a start: motor angle, deflections, speeds.
    pub fn states(self) -> usize {
        2 * self.masses
    }
    /// First entry of the start of data set `set`.
    pub fn start(self, set: usize) -> usize {
        self.shared() + set * self.states()
    }
    /// Number of parameters with `sets` data sets.
    pub fn len(self, sets: usize) -> usize {
        self.start(sets)
    }
}

impl AxisModel {
    /// Place of each parameter.
    pub fn layout(&self) -> Layout {
        Layout {
            masses: self.masses,
            orders: self.ripple_orders.len(),
        }
    }

    /// Refuse what no chain can be built from.
    ///
    /// # Errors
    /// [`AxisError::Invalid`].
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

    /// Whether the parameters `theta`, of which `free` may move, need more than two inertias,
    /// springs, dampers, viscous and Coulomb friction.
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
