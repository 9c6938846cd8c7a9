//! How much accepted formulas of one effect differ.

/// Kinds of effects with one accepted formula each, so that small differences between them count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FormulaKind {
    /// Delays and lags.
    Lag,
    /// Laws of friction.
    Friction,
    /// Weights, inertias and constant errors of torque.
    Exact,
}

/// When the formula error of an effect replaces the general one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Held {
    /// Always.
    Always,
    /// If an effect of the same kind leaves little more than noise.
    NearNoise,
    /// If an effect of the same kind leaves almost nothing of what there is to explain.
    NextToNothing,
}

/// How much two formulas of an effect may differ.
///
/// The errors are shares of the explained error that the true effect leaves, on machines that other
/// engines simulated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Formula {
    /// Effects of the same kind are compared with this error; `None` for no comparison.
    pub kind: Option<FormulaKind>,
    /// Share of the explained error by which two formulas may differ [1].
    pub error: f64,
    /// When `error` applies.
    pub held: Held,
    /// Whether the true effect leaves a white residual. A difference in loss then counts for more.
    pub white: bool,
    /// Standard deviation of a parameter between formulas, relative to its size [1].
    ///
    /// The values come from benchmark draws on foreign engines; 97 % of 1,050 checked values lie
    /// within them.
    pub value_error: f64,
    /// Whether `value_error` grows with the number of fitted parameters, because each of them
    /// compensates for a part of the formula difference.
    pub of_each: bool,
}

impl Formula {
    /// A law that books write differently: tanh or algebraic sign, backlash or dead zone.
    pub const LAW: Self = Self {
        kind: None,
        error: 0.02,
        held: Held::Always,
        white: false,
        value_error: 0.01,
        of_each: true,
    };
    /// A law with the same parameters in all books, such as springs, waves and limits. Only
    /// integrators differ.
    pub const LINEAR: Self = Self {
        value_error: 0.004,
        of_each: false,
        ..Self::LAW
    };
    /// A delay or lag. After converged fits, formulas differ by 1e-4 to 3e-4: the effect is linear
    /// in the torque, but its parameters depend on how the controller holds its command.
    pub const LAG: Self = Self {
        kind: Some(FormulaKind::Lag),
        error: 3e-4,
        white: true,
        ..Self::LAW
    };
    /// A law of friction. Formulas differ by 5e-4 if one of these laws leaves hardly more than
    /// noise.
    pub const FRICTION: Self = Self {
        kind: Some(FormulaKind::Friction),
        error: 5e-4,
        held: Held::NearNoise,
        ..Self::LAW
    };
    /// A change of a rigid body or its weight. Formulas differ by less than 1e-4.
    pub const RIGID_BODY: Self = Self {
        kind: Some(FormulaKind::Exact),
        error: 1e-4,
        ..Self::LINEAR
    };
    /// A constant error of torque or pose. Formulas differ by less than 1e-4 if one of these
    /// effects leaves next to nothing.
    pub const CONSTANT: Self = Self {
        held: Held::NextToNothing,
        ..Self::RIGID_BODY
    };
}
