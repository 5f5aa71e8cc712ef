//! The second paper's results on a simulated machine of the same class.

use std::path::Path;

use tipwatch_analyze::analysis::Analysis;
use tipwatch_analyze::analysis::inputs::GrossInputKind;
use tipwatch_analyze::analysis::run::analyse;
use tipwatch_analyze::base::options::{ClosedFormInput, Estimator, ModelKind, Options};
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::{Contribution, Quantity};
use tipwatch_tests::{Truth, by, data};

const WHEELS: [&str; 4] = ["FL", "FR", "RL", "RR"];
const RODS: [&str; 2] = ["suspension_right", "suspension_left"];

fn analysed(log: &Path, text: &str, options: Options) -> Analysis {
    let file = MachineFile::from_text(&log.with_extension("toml"), text).unwrap();
    analyse(log, &file, options, &mut |_| {}).unwrap()
}

fn machine_text(log: &Path) -> String {
    std::fs::read_to_string(log.with_extension("toml")).unwrap()
}

/// Figs. 5 and 6: with frozen inertia the loads are far off; with inertia recomputed from the actuators the error is a
/// few percent. Newton-Euler over every body is as good, because the split between the diagonals dominates the error. It
/// is far better where the ground is known to be plane, as in the paper.
#[test]
fn val_frozen_variable_and_whole_body_on_one_log() {
    let log = data("second_paper.mcap");
    let truth = Truth::smoothed_already(&log, &WHEELS);
    let text = machine_text(&log);
    let error = |text: &str, model, closed_form_input| {
        let options = Options {
            model,
            closed_form_input,
            ..Options::default()
        };
        truth.error_share(&analysed(&log, text, options))
    };
    let plane = text.replace("[contact]", "[contact]\nground = \"plane\"");
    let frozen = error(&text, ModelKind::ClosedForm, None);
    let variable = error(&text, ModelKind::VariableInertia, None);
    let felt = error(
        &text,
        ModelKind::VariableInertia,
        Some(ClosedFormInput::Accelerometer),
    );
    let whole_body = error(&text, ModelKind::WholeBody, None);
    let on_plane = error(&plane, ModelKind::WholeBody, None);
    println!(
        "of the mean load: frozen {frozen:.4}, variable {variable:.4} (felt {felt:.4}), whole body {whole_body:.4}, on a plane {on_plane:.4}"
    );
    assert!(frozen > 2.4 * variable, "{frozen} {variable}");
    assert!(variable < 0.0145 && felt < 0.0145, "{variable} {felt}");
    assert!(whole_body < 1.02 * variable, "{whole_body} {variable}");
    assert!(on_plane < 0.0035, "{on_plane}");
    let compared = analysed(&log, &text, Options::default()).comparisons;
    let models: Vec<_> = compared.iter().flatten().map(|c| c.other).collect();
    assert_eq!(models, [ModelKind::VariableInertia, ModelKind::ClosedForm]);
}

/// The machine file with the chamber pressures of both suspension cylinders bound to signals.
fn with_pressures(log: &Path) -> String {
    let mut text = machine_text(log);
    for rod in RODS {
        let side = rod.trim_start_matches("suspension_");
        let topic = |chamber: &str| {
            format!(
                "{{ topic = \"/suspension/{side}/{chamber}_pressure\", field = \"fluid_pressure\" }}"
            )
        };
        let bound = format!(
            "name = \"{rod}\"\npressure = {{ piston = {}, rod = {}, piston_area = 78.540e-4, rod_area = 53.910e-4 }}\n",
            topic("piston"),
            topic("rod")
        );
        text = text.replacen(&format!("name = \"{rod}\"\n"), &bound, 1);
    }
    text
}

/// On uneven ground a stiff frame shifts load from one diagonal to the other. No rigid-body model sees it, but the
/// pressures of the suspension cylinders do.
#[test]
fn val_chamber_pressures_pin_the_warp() {
    let log = data("bogie_bump.mcap");
    let truth = Truth::smoothed_already(&log, &WHEELS);
    let measured = |options| analysed(&log, &with_pressures(&log), options);
    let by_rule = analysed(&log, &machine_text(&log), Options::default());
    let by_torque = measured(Options::default());
    let causal = measured(by(Estimator::Causal));
    let [without, with, live] =
        [&by_rule, &by_torque, &causal].map(|analysis| truth.error_share(analysis));
    println!(
        "of the mean load: by the rule {without:.4}, by pressures {with:.4}, causal {live:.4}"
    );
    assert!(
        with < 0.2 * without && live < 0.25 * without,
        "{without} {with} {live}"
    );
    let rows = &by_torque.rows;
    let used = rows.whole().outcomes.column(Quantity::MeasuredTorques);
    let all = used.iter().filter(|&&torques| torques == 2.0).count();
    assert!(all > rows.len() * 9 / 10, "{all} of {}", rows.len());
    let said = by_torque
        .notes
        .iter()
        .find(|note| note.contains("determined the load split"));
    assert!(said.is_some(), "{:?}", by_torque.notes);
    // the measured torques narrow the envelope, which still contains the true loads
    let width = |analysis: &Analysis| -> f64 {
        let of = |quantity| {
            analysis
                .rows
                .whole()
                .outcomes
                .column(quantity)
                .iter()
                .filter(|v| v.is_finite())
                .sum::<f64>()
        };
        (0..4)
            .map(|wheel| of(Quantity::LoadLargest(wheel)) - of(Quantity::LoadLeast(wheel)))
            .sum()
    };
    assert!(width(&by_torque) < 0.4 * width(&by_rule));
    let inside = truth.share_within_envelope(&by_torque, 100.0);
    assert!(inside > 0.95, "{inside}");
    causes_still_add_up(&by_torque);
}

fn causes_still_add_up(analysis: &Analysis) {
    let rows = &analysis.rows;
    let weight = analysis.machine.mass() * analysis.machine.gravity();
    for wheel in 0..4 {
        let causes = Contribution::ALL.map(|cause| {
            rows.whole()
                .outcomes
                .column(Quantity::Contribution(cause, wheel))
        });
        let load = rows.whole().outcomes.column(Quantity::Load(wheel));
        let mut warps: f64 = 0.0;
        for row in (0..rows.len()).filter(|&row| rows.is_valid(row)) {
            let sum: f64 = causes
                .iter()
                .map(|cause| cause[row])
                .filter(|c| c.is_finite())
                .sum();
            assert!(
                (sum - load[row]).abs() < 1e-8 * weight,
                "row {row}: {sum} {}",
                load[row]
            );
            warps = warps.max(causes[Contribution::Warp as usize][row].abs());
        }
        assert!(warps > 1000.0, "{warps}");
    }
}

#[test]
fn without_pressures_the_split_rule_applies_and_is_noted() {
    let log = data("second_paper.mcap");
    let text = with_pressures(&log);
    let unbound = analysed(&log, &machine_text(&log), Options::default());
    let analysis = analysed(&log, &text, Options::default());
    assert!(
        analysis.notes.iter().any(|note| note.contains("/suspension/right/piston_pressure") && note.contains("rule")),
        "{:?}",
        analysis.notes
    );
    for wheel in 0..4 {
        let load = |analysis: &Analysis| {
            analysis
                .rows
                .whole()
                .outcomes
                .column(Quantity::Load(wheel))
                .to_vec()
        };
        assert_eq!(load(&analysis), load(&unbound));
    }
}

#[test]
fn pressures_in_another_unit_are_a_gross_input() {
    let log = data("bogie_bump.mcap");
    let in_bar = with_pressures(&log).replace(
        "field = \"fluid_pressure\"",
        "field = \"fluid_pressure\", scale = 1e-5",
    );
    let analysis = analysed(&log, &in_bar, Options::default());
    let found = analysis.gross_inputs.first().expect("a gross input");
    assert_eq!(found.kind, GrossInputKind::ActuatorScale);
    assert!(found.fix.contains("100000 for bar"), "{}", found.fix);
}
