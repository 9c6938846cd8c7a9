//! An effect with its place and parameters.

use axisight_scalar::Scalar;

/// What an effect acts on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// The whole arm.
    Arm,
    /// A driven axis, from 0.
    Axis(usize),
    /// Two driven axes, from 0, in order.
    Axes(usize, usize),
}

impl std::fmt::Display for Place {
    /// Axes are counted from 1, as users do.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        // A user's axis 0 is the largest integer here; `wrapping_add` gives 0 again.
        match self {
            Self::Arm => write!(f, "no axis"),
            Self::Axis(i) => write!(f, "axis {}", i.wrapping_add(1)),
            Self::Axes(i, j) => {
                write!(f, "axes {} and {}", i.wrapping_add(1), j.wrapping_add(1))
            }
        }
    }
}

/// An effect with its place and parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectSetting<S> {
    /// Name in the effect table.
    pub name: String,
    /// Place where it acts.
    pub place: Place,
    /// Parameters, in the order of the effect table.
    pub parameters: Vec<S>,
}

impl<S> EffectSetting<S> {
    /// Name and place in user notation: `payload`, `backlash@2`, `axis_coupling@5,6`.
    pub fn label(&self) -> String {
        let name = &self.name;
        match self.place {
            Place::Arm => name.clone(),
            Place::Axis(i) => format!("{name}@{}", i.wrapping_add(1)),
            Place::Axes(i, j) => {
                format!("{name}@{},{}", i.wrapping_add(1), j.wrapping_add(1))
            }
        }
    }

    /// Whether this is the same effect at the same place as another.
    pub fn replaces<T>(&self, other: &EffectSetting<T>) -> bool {
        self.name == other.name && self.place == other.place
    }
}

impl EffectSetting<f64> {
    /// The same setting over another scalar.
    pub fn lifted<S: Scalar>(&self) -> EffectSetting<S> {
        EffectSetting {
            name: self.name.clone(),
            place: self.place,
            parameters: self.parameters.iter().map(|p| S::constant(*p)).collect(),
        }
    }
}
