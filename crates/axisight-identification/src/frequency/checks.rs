//! Checks of the input of a fit, field by field.

use super::error::{FrequencyFitError, invalid};
use super::hold::Hold;
use super::settings::{FrequencyOptions, FrequencyParameter};
use super::weighting::{Criterion, PoseResponse, Uncertainty};
use axisight_core::robot::RobotDescription;
use nalgebra::Complex;

type C = Complex<f64>;

pub(super) fn check_parameters(
    parameters: &[FrequencyParameter],
    robot: &RobotDescription,
) -> Result<(), FrequencyFitError> {
    if parameters.iter().all(|p| p.frozen) {
        return Err(invalid(
            "parameters",
            "at least one that is not frozen",
            parameters.len(),
        ));
    }
    for (i, p) in parameters.iter().enumerate() {
        let name = p.parameter.name(robot);
        let inside = p.lower <= p.initial && p.initial <= p.upper && p.initial.is_finite();
        if !inside {
            let expected = format!("a start between {} and {}", p.lower, p.upper);
            return Err(invalid(&name, &expected, p.initial));
        }
        if p.logarithmic && p.lower <= 0.0 {
            let expected = "a positive lower bound for a search over the logarithm";
            return Err(invalid(&name, expected, p.lower));
        }
        if p.prior
            .is_some_and(|(mean, std)| !(mean.is_finite() && std > 0.0 && std.is_finite()))
        {
            return Err(invalid(
                &name,
                "a prior of finite mean and positive deviation",
                "another",
            ));
        }
        if parameters
            .iter()
            .take(i)
            .any(|other| other.parameter == p.parameter)
        {
            return Err(invalid(&name, "each parameter once", "it twice"));
        }
    }
    Ok(())
}

pub(super) fn check_pose(
    pose: &PoseResponse,
    n_axes: usize,
    number: usize,
    options: FrequencyOptions,
) -> Result<(), FrequencyFitError> {
    let field = |what: &str| format!("response {}: {what}", number + 1);
    let lines = pose.frequency_hz.len();
    let elements = lines * n_axes * n_axes;
    if lines == 0 {
        return Err(invalid(&field("frequency_hz"), "at least one line", 0));
    }
    let highest = match options.hold {
        Hold::Continuous => f64::INFINITY,
        Hold::ZeroOrder(step) => 0.5 / step,
    };
    if let Some(f) = pose
        .frequency_hz
        .iter()
        .find(|f| !(**f > 0.0 && **f < highest))
    {
        let expected = format!("frequencies above zero and below {highest} Hz");
        return Err(invalid(&field("frequency_hz"), &expected, f));
    }
    if pose.response.len() != elements {
        return Err(invalid(
            &field("response"),
            &format!("{elements} numbers"),
            pose.response.len(),
        ));
    }
    if let Some(g) = pose
        .response
        .iter()
        .find(|g| !(g.re.is_finite() && g.im.is_finite()))
    {
        return Err(invalid(&field("response"), "finite numbers", g));
    }
    if let Some(reference) = &pose.reference {
        let usable = |g: &C| g.re.is_finite() && g.im.is_finite() && *g != C::default();
        if reference.len() != elements || !reference.iter().all(usable) {
            let expected = format!("{elements} finite numbers other than zero");
            return Err(invalid(&field("reference"), &expected, "others"));
        }
    }
    let left_out = check_uncertainty(&pose.uncertainty, elements, n_axes, &field("variance"))?;
    let zero = pose
        .response
        .iter()
        .zip(&left_out)
        .any(|(g, out)| *g == C::default() && !out);
    if options.criterion == Criterion::Logarithmic && zero {
        let expected =
            "elements other than zero for a logarithm (an infinite variance leaves one out)";
        return Err(invalid(&field("response"), expected, 0));
    }
    Ok(())
}

/// Check the uncertainty; returns for each element whether the uncertainty leaves it out.
fn check_uncertainty(
    uncertainty: &Uncertainty,
    elements: usize,
    n_axes: usize,
    field: &str,
) -> Result<Vec<bool>, FrequencyFitError> {
    let sized = |length: usize, wanted: usize| {
        let expected = format!("{wanted} numbers");
        (length == wanted)
            .then_some(())
            .ok_or_else(|| invalid(field, &expected, length))
    };
    let (weighing, stated) = match uncertainty {
        Uncertainty::Unknown => return Ok(vec![false; elements]),
        Uncertainty::Covariance(v) => {
            sized(v.len(), elements * n_axes * n_axes)?;
            return Ok(vec![false; elements]);
        }
        Uncertainty::Variance(v) => (v, v),
        Uncertainty::Pooled { stated, weighing } => (weighing, stated),
    };
    for v in [weighing, stated] {
        sized(v.len(), elements)?;
        if let Some(bad) = v.iter().find(|v| v.is_nan() || **v <= 0.0) {
            return Err(invalid(field, "positive numbers", bad));
        }
    }
    let left_out = |(w, v): (&f64, &f64)| w.is_infinite() || v.is_infinite();
    Ok(weighing.iter().zip(stated).map(left_out).collect())
}
