//! Bands of an identified machine follow from the joint uncertainty of its parameters.

use nalgebra::{DMatrix, DVector};
use tipwatch_calibration::identification::identify;
use tipwatch_mechanics::machine::{Parameter, Unknown};
use tipwatch_mechanics::{RestingMachine, Scope, Workspace, evaluate_one};

use crate::support::{Noise, machine, postures, row, weighings, wrong};

#[test]
fn the_band_is_the_propagated_covariance() {
    let truth = machine("");
    let mut noise = Noise::new(61);
    let stated = wrong(&truth, &mut noise);
    let found = identify(&stated, None, &weighings(&truth, 6, 20.0, &mut noise)).unwrap();
    let identified = stated.with_identified(found.identified);
    let known = identified.identified().unwrap();
    let size = known.unknowns.len();
    // P = D (I - sum of shares v v') D, in full
    let mut covariance = DMatrix::<f64>::identity(size, size);
    for direction in &known.directions {
        let v = DVector::from_vec(direction.weights.clone());
        covariance -= &v * v.transpose() * direction.share;
    }
    let scope = Scope {
        sensitivities: true,
        ..Scope::LOADS
    };
    let parameters = Parameter::all(&identified);
    for positions in postures(&truth, 3, &mut noise) {
        let state = row(&identified, &positions);
        let mut workspace = Workspace::with_scope(&identified, scope);
        evaluate_one(&identified, &state, &mut workspace);
        for wheel in 0..4 {
            let by = workspace.sensitivity().load(wheel);
            let is_bias = |unknown: &Unknown| {
                matches!(unknown, Unknown::Parameter(Parameter::SpecificForce(_)))
            };
            // the bias of the accelerometer is that of its own estimator, in every row
            let mut bias = 0.0;
            let slope = known
                .unknowns
                .iter()
                .zip(&known.prior_sigma)
                .map(|(unknown, sigma)| {
                    let slope = unknown.derivative(&identified, &parameters, &by);
                    if is_bias(unknown) {
                        bias += (slope * identified.uncertainty().accelerometer_bias).powi(2);
                        return 0.0;
                    }
                    slope * sigma
                });
            let slope = DVector::from_iterator(size, slope);
            let mean = workspace.outcome().normal_force / 4.0;
            let model = (identified.uncertainty().model_share * mean).powi(2);
            let expected = (slope.dot(&(&covariance * &slope)) + bias + model).sqrt();
            let band = workspace.outcome().uncertainty.load[wheel];
            let parts: f64 = known
                .variance_parts(&identified, &parameters, &by)
                .into_iter()
                .flatten()
                .sum();
            let of_parameters = expected.powi(2) - bias - model;
            assert!(
                (parts - of_parameters).abs() < 1e-6 * of_parameters,
                "{parts} {of_parameters}"
            );
            assert!(
                (band - expected).abs() < 1e-6 * expected,
                "{band} {expected}"
            );
        }
    }
}

#[test]
fn correlations_narrow_the_band_of_the_whole_machine() {
    let truth = machine("");
    let mut noise = Noise::new(62);
    let stated = wrong(&truth, &mut noise);
    let found = identify(&stated, None, &weighings(&truth, 6, 20.0, &mut noise)).unwrap();
    let identified = stated.with_identified(found.identified);
    let positions = postures(&truth, 1, &mut noise).remove(0);
    let all = [0, 1, 2, 3];
    let [before, after] = [&stated, &identified]
        .map(|machine| RestingMachine::new(machine, &positions).load_of(&all).1);
    // the masses of platform and arm stay uncertain one by one, their sum does not
    assert!(after < 0.2 * before, "{before} {after}");
    let platform = Parameter::LinkMass(0).sigma(&identified) * 9.8066;
    assert!(platform > after, "{platform} {after}");
}
