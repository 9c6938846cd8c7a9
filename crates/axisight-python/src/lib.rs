//! Python bindings of the Axisight core, without numerics of their own.

// PyO3 passes owned values and names the lifetime of the interpreter.
#![allow(clippy::needless_pass_by_value, clippy::elidable_lifetime_names)]

mod accelerometers;
mod axis_fit;
mod convert;
mod effects;
mod entry;
mod excitation;
mod fit;
mod fit_results;
mod fit_specs;
mod floating;
mod frequency_fit;
mod frf;
mod joints;
mod local_models;
mod montecarlo;
mod own_pool;
mod plant;
mod recursion;
mod regressor;
mod robot;
mod simulation;

use pyo3::prelude::*;

/// Reason why this processor cannot run the kernels, or `None`.
fn unsupported() -> Option<&'static str> {
    #[cfg(target_arch = "x86_64")]
    if !(is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")) {
        return Some("axisight needs a processor with AVX2 and FMA (x86-64-v3)");
    }
    None
}

#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    if let Some(reason) = unsupported() {
        return Err(pyo3::exceptions::PyImportError::new_err(reason));
    }
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<robot::Robot>()?;
    module.add_class::<entry::CancelToken>()?;
    module.add_class::<fit_results::Column>()?;
    module.add_class::<fit::Courses>()?;
    module.add_class::<fit::SimulatedLogs>()?;
    module.add_class::<fit::MeasuredMotions>()?;
    module.add_class::<fit_results::Diverged>()?;
    module.add_class::<fit_results::FitResult>()?;
    module.add_class::<fit_results::Linearization>()?;
    module.add_function(wrap_pyfunction!(effects::effect_table, module)?)?;
    module.add_function(wrap_pyfunction!(simulation::check_integrator, module)?)?;
    module.add_function(wrap_pyfunction!(simulation::simulate_batch, module)?)?;
    module.add_function(wrap_pyfunction!(simulation::measurement_noise, module)?)?;
    module.add_function(wrap_pyfunction!(accelerometers::accelerometers, module)?)?;
    module.add_function(wrap_pyfunction!(accelerometers::specific_force, module)?)?;
    module.add_function(wrap_pyfunction!(accelerometers::described_as, module)?)?;
    module.add_function(wrap_pyfunction!(floating::floating_base, module)?)?;
    module.add_function(wrap_pyfunction!(floating::base_names, module)?)?;
    module.add_function(wrap_pyfunction!(floating::floating_inertia, module)?)?;
    module.add_function(wrap_pyfunction!(
        floating::floating_inverse_dynamics,
        module
    )?)?;
    module.add_function(wrap_pyfunction!(
        floating::floating_forward_dynamics,
        module
    )?)?;
    module.add_function(wrap_pyfunction!(plant::state_at_rest, module)?)?;
    module.add_function(wrap_pyfunction!(plant::state_rates, module)?)?;
    module.add_function(wrap_pyfunction!(fit::status_advice, module)?)?;
    module.add_function(wrap_pyfunction!(excitation::random_phases, module)?)?;
    module.add_function(wrap_pyfunction!(excitation::multisine_peak, module)?)?;
    module.add_function(wrap_pyfunction!(excitation::square_period, module)?)?;
    module.add_function(wrap_pyfunction!(excitation::directions, module)?)?;
    module.add_function(wrap_pyfunction!(excitation::optimize_crest_factor, module)?)?;
    module.add_class::<montecarlo::MonteCarloStudy>()?;
    module.add_class::<montecarlo::MonteCarloEnsemble>()?;
    module.add_function(wrap_pyfunction!(montecarlo::failure_kinds, module)?)?;
    module.add_function(wrap_pyfunction!(frf::invert_matrices, module)?)?;
    module.add_function(wrap_pyfunction!(frf::right_divide_matrices, module)?)?;
    module.add_function(wrap_pyfunction!(frf::record_spectra, module)?)?;
    module.add_function(wrap_pyfunction!(frf::multivariable, module)?)?;
    module.add_function(wrap_pyfunction!(local_models::frf_local_model, module)?)?;
    module.add_function(wrap_pyfunction!(local_models::frf_local_periodic, module)?)?;
    module.add_function(wrap_pyfunction!(recursion::recursive, module)?)?;
    module.add_function(wrap_pyfunction!(recursion::linear_states, module)?)?;
    module.add_function(wrap_pyfunction!(regressor::torque_regressor, module)?)?;
    module.add_function(wrap_pyfunction!(regressor::inertial_parameters, module)?)?;
    module.add_function(wrap_pyfunction!(regressor::energy_regressor, module)?)?;
    module.add_function(wrap_pyfunction!(regressor::regression_factors, module)?)?;
    module.add_function(wrap_pyfunction!(axis_fit::axis_fit, module)?)?;
    module.add_function(wrap_pyfunction!(axis_fit::axis_linearize, module)?)?;
    module.add_function(wrap_pyfunction!(axis_fit::axis_simulate, module)?)?;
    module.add_class::<frequency_fit::FrequencyFitResult>()?;
    module.add_function(wrap_pyfunction!(
        frequency_fit::fit_frequency_responses,
        module
    )?)?;
    module.add_function(wrap_pyfunction!(
        frequency_fit::frequency_information,
        module
    )?)?;
    module.add_function(wrap_pyfunction!(frequency_fit::frequency_response, module)?)?;
    module.add_function(wrap_pyfunction!(frequency_fit::design_poses, module)?)?;
    Ok(())
}
