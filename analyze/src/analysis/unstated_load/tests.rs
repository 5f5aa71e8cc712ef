//! Falls of simulated machines whose load is known. The onset is that of the simulated contact forces.

use std::path::{Path, PathBuf};

use tipwatch_binding::MachineFile;

use super::fall::Fall;
use super::{ExplainedFall, LoadEstimates, MassEstimate, study};
use crate::analysis::run::analyse;
use crate::base::options::{Estimator, Options};
use crate::tables::parquet;

/// The left edge of a machine with four wheels.
const LEFT: usize = 1;

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../tests/data")
        .join(name)
}

/// Returns the time from which both right wheels were off the ground for good (ns).
fn true_onset_ns(log: &str) -> i64 {
    let table = parquet::read(&data(&format!("{log}.truth.parquet"))).unwrap();
    let times = table.column("t_ns").unwrap().integers().unwrap();
    let load = |wheel: &str| {
        table
            .column(&format!("load_{wheel}"))
            .unwrap()
            .numbers()
            .unwrap()
    };
    let (front, rear) = (load("fr"), load("rr"));
    let down = (0..times.len()).rposition(|row| front[row] + rear[row] > 1.0);
    times[down.unwrap() + 1]
}

fn explained(log: &str) -> ExplainedFall {
    explained_by(log, Estimator::Smoother)
}

fn explained_by(log: &str, estimator: Estimator) -> ExplainedFall {
    let path = data(&format!("{log}.mcap"));
    let file = MachineFile::read(&path.with_extension("toml")).unwrap();
    let options = Options {
        estimator,
        ..Options::default()
    };
    let analysis = analyse(&path, &file, options, &mut |_| {}).unwrap();
    let fall = Fall {
        edge: LEFT,
        onset_ns: true_onset_ns(log),
        onset_in_log: true,
        onset_sigma_s: Some(0.03),
        until_ns: i64::MAX,
    };
    let mut found = study(&analysis.rows, &[fall]);
    assert_eq!(found.len(), 1);
    found.remove(0)
}

fn estimates(load: &LoadEstimates) -> [Option<MassEstimate>; 3] {
    [load.by_lean, load.by_onset, load.by_fall]
}

#[test]
fn val_an_unstated_load_is_weighed_by_the_fall() {
    const TRUE_KG: f64 = 350.0;
    let found = explained("unstated_load");
    let best = &found.explanations[0];
    assert_eq!(best.kind, "load_on_tool", "{found:#?}");
    let load = found.load.as_ref().unwrap();
    let mass = load.combined.unwrap();
    let error_kg = mass.mass_kg - TRUE_KG;
    assert!(error_kg.abs() < 0.15 * TRUE_KG, "{load:#?}");
    assert!(error_kg.abs() < 2.0 * mass.sigma_kg, "{load:#?}");
    assert!(mass.mass_kg.abs() > 2.0 * mass.sigma_kg, "{load:#?}");
    // each way alone has the load within three standard deviations
    for estimate in estimates(load).iter().flatten() {
        let error_kg = estimate.mass_kg - TRUE_KG;
        assert!(error_kg.abs() < 3.0 * estimate.sigma_kg, "{load:#?}");
    }
    assert!(
        load.by_lean.is_some() && load.by_fall.is_some(),
        "{load:#?}"
    );
    let stated = found
        .explanations
        .iter()
        .find(|e| e.kind == "stated_machine");
    assert!(stated.unwrap().probability < 1e-3, "{found:#?}");
    let total: f64 = found.explanations.iter().map(|e| e.probability).sum();
    assert!((total - 1.0).abs() < 1e-9);
}

/// The moment about the edge has a largest value as a joint turns: amounts beyond it, and those that are reached by going on straight
/// from there, explain nothing.
#[test]
fn no_encoder_is_blamed_for_an_unstated_load_by_amounts_that_were_not_computed_with() {
    let found = explained_by("unstated_load", Estimator::Causal);
    let best = &found.explanations[0];
    assert_eq!(best.kind, "load_on_tool", "{found:#?}");
    assert!(best.probability > 0.9, "{found:#?}");
}

#[test]
fn val_a_stated_load_leaves_nothing_to_explain() {
    let found = explained("tip_over");
    let best = &found.explanations[0];
    assert_eq!(best.kind, "stated_machine", "{found:#?}");
    let mass = found.load.as_ref().unwrap().combined.unwrap();
    assert!(mass.mass_kg.abs() <= 2.0 * mass.sigma_kg, "{found:#?}");
    assert!(mass.sigma_kg < 60.0, "{found:#?}");
}

#[test]
fn a_force_inwards_is_no_cause_of_a_fall() {
    let found = explained("tip_over");
    let forces = found
        .explanations
        .iter()
        .filter(|it| it.kind == "force_on_tool");
    for force in forces {
        assert!(force.amounts[0].value >= 0.0, "{force:?}");
    }
}

#[test]
fn a_rotation_without_known_rows_is_not_explained() {
    let path = data("tip_over.mcap");
    let file = MachineFile::read(&path.with_extension("toml")).unwrap();
    let analysis = analyse(&path, &file, Options::default(), &mut |_| {}).unwrap();
    let end_ns = *analysis.rows.times_ns.last().unwrap();
    let fall = Fall {
        edge: LEFT,
        onset_ns: end_ns,
        onset_in_log: true,
        onset_sigma_s: None,
        until_ns: end_ns,
    };
    let found = study(&analysis.rows, &[fall]);
    let why = found[0].not_estimated.as_deref();
    assert_eq!(why, Some("too few rows of the rotation can be computed"));
    assert!(found[0].explanations.is_empty() && found[0].load.is_none());
}
