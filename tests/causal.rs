//! An analysis with the causal estimator equals sample-by-sample evaluation bit for bit.

use std::path::Path;

use tipwatch_analyze::base::options::Estimator;
use tipwatch_analyze::load::load;
use tipwatch_binding::MachineFile;
use tipwatch_ingest::Log;
use tipwatch_mechanics::estimation::{CausalEstimator, RowClock};
use tipwatch_mechanics::state::{Reason, Reasons};
use tipwatch_mechanics::{Quantity, Scope, Workspace, evaluate};
use tipwatch_tests::{analysed, analysed_with, by, data, write_edited};

#[test]
fn causal_analysis_equals_sample_by_sample() {
    let path = data("tiny_lift.mcap");
    assert_equals_one_sample_at_a_time(&path, &path.with_extension("toml"));
}

#[test]
fn implausible_signals_keep_that_equality() {
    let folder = tempfile::tempdir().unwrap();
    let (source, path) = (data("tiny_lift.mcap"), folder.path().join("faulty.mcap"));
    let mut samples = 0;
    write_edited(&source, &path, &mut |topic, values| {
        samples += 1;
        match (topic, samples % 97) {
            ("/imu/data", 0..7) => values.set("force.x", f64::NAN),
            ("/imu/data", 50..55) => values.set("turning.z", 8.0),
            ("/joint_states", 10..20) => values.set("velocity.slew", 3.0),
            ("/joint_states", 40) => values.set("position.lift", 2.0),
            ("/joint_states", 60..63) => values.set("position.lift", f64::INFINITY),
            _ => {}
        }
    });
    let rows = assert_equals_one_sample_at_a_time(&path, &source.with_extension("toml"));
    for reason in [Reason::ImuFault, Reason::JointsFault] {
        assert!(rows.iter().any(|reasons| reasons.has(reason)), "{reason:?}");
    }
}

fn assert_equals_one_sample_at_a_time(path: &Path, machine: &Path) -> Vec<Reasons> {
    let analysis = analysed_with(path, machine, by(Estimator::Causal));
    let log = Log::open(path).unwrap();
    let file = MachineFile::read(machine).unwrap();
    let loaded = load(&log, &file, Estimator::Causal, &mut |_| {}).unwrap();
    // the machine of the analysis, which has its reference loads
    let machine = &analysis.machine;
    let mut estimator =
        CausalEstimator::new(machine, &loaded.matched.sensors, RowClock::JointStates);
    let mut workspace = Workspace::<f64>::with_scope(machine, Scope::ALL);
    let mut row = 0;
    let walked = loaded.for_each_arrival(|sample| {
        let _ = estimator.push(machine, sample, &mut |estimate| {
            let outcome = evaluate(machine, &estimate.state, &mut workspace);
            assert_eq!(analysis.rows.times_ns[row], estimate.time_ns);
            assert_eq!(
                analysis.rows.reasons[row],
                estimate.reasons.with_outcome(outcome)
            );
            for quantity in Quantity::all(machine, Scope::ALL) {
                let (batch, alone) = (
                    analysis.rows.whole().outcomes.column(quantity)[row],
                    outcome.get(quantity),
                );
                assert!(
                    batch.to_bits() == alone.to_bits() || (batch.is_nan() && alone.is_nan()),
                    "{quantity:?} in row {row}"
                );
            }
            row += 1;
        });
    });
    walked.unwrap();
    assert_eq!(row, analysis.rows.len());
    assert!(row > 300);
    analysis.rows.reasons
}

#[test]
fn rows_before_the_first_imu_sample_do_not_spoil_later_ones() {
    let log = data("../../analyze/demo/demo.mcap");
    let analysis = analysed(&log, by(Estimator::Causal));
    let reasons = &analysis.rows.reasons;
    assert!(
        reasons[0].has(Reason::ImuGap),
        "the log starts with joint states: {:?}",
        reasons[0]
    );
    assert!(reasons[40..].iter().all(|reasons| reasons.is_empty()));
}
