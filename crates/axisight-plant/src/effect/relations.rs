//! How an effect and others are akin: the plainer law in it, what it is like, what a fit of it begins from.

/// How one sees that a law has what it adds to a plainer one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shown {
    /// By the standard errors of the numbers that it adds, each of its own size.
    Sizes,
    /// By how much larger its friction is at some speed than at high speed.
    Rise,
}

/// The law that an effect is, where what it adds is not there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plainer {
    /// Its name.
    pub law: &'static str,
    /// Parameters of the effect that it has not.
    pub adds: &'static [&'static str],
    /// How many times likelier it is than the effect, where nothing of these shows [1].
    pub likelier: f64,
    /// How that shows.
    pub shown: Shown,
}

/// An effect that another one, at some values of its parameters, is hardly to be told from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resembles {
    /// Name of that effect, which has one parameter.
    pub law: &'static str,
    /// Parameter in proportion to that one.
    pub size: &'static str,
    /// That one over this parameter.
    pub ratio: f64,
    /// Values of the other parameters.
    pub shape: &'static [(&'static str, f64)],
    /// Of machines that both describe as well, how many times as many have that effect [1].
    pub rarer: f64,
}

/// A law that a fit may begin from: as that ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BegunFrom {
    /// Its name.
    pub law: &'static str,
    /// Parameters of that law, each with the one that takes its value.
    pub takes: &'static [(&'static str, &'static str)],
}

/// Numbers of a law that are looked for only where its fit without them ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Later {
    /// Amplitude that is held at its neutral value first.
    pub amplitude: &'static str,
    /// Where its fit begins then, in its unit.
    pub begin: f64,
    /// How large it may be then, in its unit.
    pub most: f64,
    /// Shape of it.
    pub shape: &'static str,
    /// Law whose start values and bounds that shape has, under the same name.
    pub as_of: &'static str,
}

/// A machine part or property of which an axis has one, and several effects are laws.
///
/// A second law of it on an axis is no second cause: it mends the formula of the first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LawOf {
    /// The gear as a spring and damper.
    Gear,
    /// Dry friction.
    DryFriction,
}

/// A gear whose law makes it another spring.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SpringChange {
    /// Parameters whose sums are the changes of its stiffness [1], that of its middle first.
    pub sums: &'static [&'static [&'static str]],
    /// Law of a gear whose middle has lost its stiffness.
    pub without_middle: &'static str,
}

/// Whose torques masses, weights and poses change as another unit of torque does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scales {
    /// That of its own axis.
    Own,
    /// Those of its axis and of what carries that; of the whole arm all.
    Carriers,
    /// Those of all axes.
    Every,
}
