//! Logs of real robots, not part of the repository: without ground truth, but with every kind of irregularity.

use tipwatch_analyze::analysis::Analysis;
use tipwatch_analyze::analysis::clock::text::TopicsFinding;
use tipwatch_analyze::analysis::run::analyse;
use tipwatch_analyze::base::options::Options;
use tipwatch_analyze::policy::facts::LogFacts;
use tipwatch_binding::MachineFile;
use tipwatch_ingest::ClockFindingKind;
use tipwatch_mechanics::Quantity;
use tipwatch_tests::{beside, data};

fn analysed(log: &str, machine: &str) -> Analysis {
    let file = MachineFile::read(&data(machine)).unwrap();
    analyse(&beside(log), &file, Options::default(), &mut |_| {}).unwrap()
}

/// Mean sum of the loads over the valid rows, relative to the weight. Nearly all rows must be valid.
fn weight_share(analysis: &Analysis) -> f64 {
    let force = analysis.rows.whole().outcomes.column(Quantity::NormalForce);
    let valid: Vec<f64> = force.iter().copied().filter(|f| f.is_finite()).collect();
    assert!(valid.len() * 100 > force.len() * 98, "{}", valid.len());
    valid.iter().sum::<f64>()
        / valid.len() as f64
        / (analysis.machine.mass() * analysis.machine.gravity())
}

mod needs_shared {
    use super::*;

    #[test]
    #[ignore = "needs ../shared"]
    fn abitobot_has_its_weight_and_simulation_time() {
        let analysis = analysed("real/abitobot", "abitobot.toml");
        assert!((analysis.machine.mass() - 954.0).abs() < 0.5);
        assert!(
            (weight_share(&analysis) - 1.0).abs() < 0.03,
            "{}",
            weight_share(&analysis)
        );
        let told = |text: &str| analysis.notes.iter().any(|note| note.contains(text));
        assert!(told("integrity cannot be verified") && told("implausible values are flagged"));
        let simulated =
            |found: &TopicsFinding| found.finding.kind == ClockFindingKind::SimulationTime;
        let found = analysis.clock.findings.iter().find(|f| simulated(f));
        assert_eq!(found.unwrap().topics.len(), analysis.inputs.len());
        // its stamps are no dates, and its report has that of the recorder
        let facts = LogFacts::of(&analysis, &[], Vec::new());
        let hours = |ns: i64| ns / 3_600_000_000_000;
        assert!(hours(facts.start_ns) < 24);
        assert!(facts.start_utc_ns.is_some_and(|ns| hours(ns) > 450_000));
        for input in &analysis.inputs {
            let timing = &input.timing;
            assert!(input.clock.starts_with("header.stamp"), "{}", input.clock);
            assert!(timing.header_minus_log.unwrap().median_s < -1e9);
        }
    }

    #[test]
    #[ignore = "needs ../shared"]
    fn turtlebot3_brings_its_machine_and_has_its_weight() {
        let analysis = analysed("real/turtlebot3", "turtlebot3.toml");
        assert_eq!(analysis.provenance.urdf.path, "topic /robot_description");
        assert!(
            (weight_share(&analysis) - 1.0).abs() < 0.01,
            "{}",
            weight_share(&analysis)
        );
    }
}
