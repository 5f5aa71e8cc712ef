//! Derivatives by the adjoint against differences of the predictions.

use tipwatch_calibration::identification::{Situation, identify, predicted};
use tipwatch_mechanics::machine::{Parameter, Unknown};
use tipwatch_mechanics::{Scope, Workspace, evaluate_one};

use crate::support::{Noise, channels, machine, postures, row, weighed, wrong};

#[test]
fn loads_of_a_row_change_as_the_adjoint_says() {
    let machine = machine("");
    let mut noise = Noise::new(5);
    let scope = Scope {
        sensitivities: true,
        ..Scope::LOADS
    };
    let unknowns = Unknown::all(&machine);
    let parameters = Parameter::all(&machine);
    for positions in postures(&machine, 3, &mut noise) {
        let mut state = row(&machine, &positions);
        state.imu.specific_force += nalgebra::Vector3::new(0.8, -0.5, 0.1);
        state.imu.angular_velocity.z = 0.3;
        let situation = Situation::Logged(Box::new(state.clone()));
        let instant = weighed(&machine, situation, 0.0, 0.0, &mut noise);
        let mut workspace = Workspace::with_scope(&machine, scope);
        evaluate_one(&machine, &state, &mut workspace);
        for &unknown in &unknowns {
            let step = 1e-3 * unknown.stated_sigma(&machine);
            let at = |change: f64| predicted(&machine, &[unknown], &[change], &instant);
            let (below, above) = (at(-step), at(step));
            for wheel in 0..4 {
                let by_adjoint = workspace.sensitivity().load(wheel);
                let exact = unknown.derivative(&machine, &parameters, &by_adjoint);
                let difference = (above[wheel] - below[wheel]) / (2.0 * step);
                let scale = 1e-4 * exact.abs() + 1e-3 / unknown.stated_sigma(&machine);
                let name = unknown.name(&machine);
                assert!(
                    (exact - difference).abs() < scale,
                    "{name}: {exact} {difference}"
                );
            }
        }
    }
}

#[test]
fn nothing_can_be_identified_from_nothing() {
    let machine = machine("");
    let mut noise = Noise::new(1);
    let data = tipwatch_calibration::identification::Data {
        channels: channels(&machine, 0.0),
        sources: Vec::new(),
    };
    assert!(identify(&machine, None, &data).is_err());
    let _ = wrong(&machine, &mut noise);
}
