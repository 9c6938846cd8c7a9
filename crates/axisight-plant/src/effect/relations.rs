//! Relations between effects: the plainer law in an effect, look-alikes, and fits that start
//! another fit.

/// How logs show that a law has what it adds to a plainer law.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shown {
    /// By the standard errors of the added parameters, relative to their sizes.
    Sizes,
    /// By the standard error of at least one of them: they are the two sides of one wave.
    Either,
    /// By the rise of friction at some speed above its value at high speed.
    Rise,
}

/// The plainer law that an effect contains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plainer {
    /// Name of the plainer law.
    pub law: &'static str,
    /// Parameters that the effect adds to the plainer law.
    pub adds: &'static [&'static str],
    /// How many times as likely the plainer law is if the logs do not show the added parameters
    /// [1].
    pub likelier: f64,
    /// How the logs show the added parameters.
    pub shown: Shown,
}

/// An effect that another effect equals at some values of its parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resembles {
    /// Name of the equalled effect, which has one parameter.
    pub law: &'static str,
    /// Parameter of the other effect that is proportional to the parameter of `law`.
    pub size: &'static str,
    /// Ratio of the parameter of `law` to the parameter `size`.
    pub ratio: f64,
    /// Values of the other parameters.
    pub shape: &'static [(&'static str, f64)],
    /// How many times as many machines have `law`, if both effects describe them equally well [1].
    pub rarer: f64,
}

/// A law whose fit can start the fit of another effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BegunFrom {
    /// Name of the law.
    pub law: &'static str,
    /// Pairs of a parameter of the law and the parameter of the effect that takes its value.
    pub takes: &'static [(&'static str, &'static str)],
}

/// Parameters of a law that are fitted in a second step, after the fit without them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Later {
    /// Amplitude that is first held at its neutral value.
    pub amplitude: &'static str,
    /// Start value of the amplitude in the second step, in its unit.
    pub begin: f64,
    /// Upper bound of the amplitude in the second step, in its unit.
    pub most: f64,
    /// Shape that belongs to the amplitude.
    pub shape: &'static str,
    /// Law that has a parameter of the same name as `shape`, and gives its start values and bounds.
    pub as_of: &'static str,
}

/// A part or property of which an axis has only one, while several effects are laws of it.
///
/// A second law on the same axis is not a second cause. It corrects the formula of the first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LawOf {
    /// The gear as a spring and damper.
    Gear,
    /// Dry friction.
    DryFriction,
}

/// How a law changes the spring of a gear.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SpringChange {
    /// Parameters whose sums are the relative changes of stiffness [1], from the middle outwards.
    pub sums: &'static [&'static [&'static str]],
    /// Name of the law for a gear without stiffness in its middle.
    pub without_middle: &'static str,
}

/// The torques that an effect scales like a change of torque unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scales {
    /// The torque of its own axis.
    Own,
    /// The torques of its axis and of the axes that carry it; for the arm, all torques.
    Carriers,
    /// The torques of all axes.
    Every,
}
