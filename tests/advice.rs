//! Advice: every change that is advised holds in an independent evaluation, row by row, and first-order changes that do
//! not hold are not advised.

use nalgebra::Vector3;
use tipwatch_analyze::analysis::Analysis;
use tipwatch_analyze::analysis::advice::{Advice, Change, SimulatedChange};
use tipwatch_analyze::analysis::run::analyse;
use tipwatch_analyze::base::options::Options;
use tipwatch_analyze::report;
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::state::Reason;
use tipwatch_mechanics::{Parameter, Quantity, Scope, State, Workspace, evaluate};
use tipwatch_tests::data;

/// A log with a machine file in which one text replaces another.
struct Run {
    log: &'static str,
    replaced: [&'static str; 2],
}

const LIFTS: [Run; 3] = [
    run("../../analyze/demo/demo.mcap", ["", ""]),
    run("tiny_lift.mcap", ["", ""]),
    run("swing_lift.mcap", ["", ""]),
];

/// Logs in which no wheel falls below its limit: theirs is raised above the smallest load, by a share of the mean one.
const DRIVING_AND_WORKING: [(&str, f64); 5] = [
    ("hard_brake.mcap", 0.1),
    ("corner_brake.mcap", 0.05),
    ("lift_payload.mcap", 0.1),
    ("tiny.mcap", 0.05),
    ("forwarder6.mcap", 0.02),
];

/// A heavier load in the machine file than on the machine: the model tips over while the machine does not.
const TIPPING: Run = run(
    "tiny.mcap",
    [
        "[contact]",
        "[[payload]]\nlink = \"tool\"\nmass = 600.0\ncom = [0.4, 0.0, 0.0]\n\n[contact]",
    ],
);

const fn run(log: &'static str, replaced: [&'static str; 2]) -> Run {
    Run { log, replaced }
}

/// The analysis of a log with a limit that its lightest wheel falls below.
fn with_raised_limit(log: &'static str, share: f64) -> Analysis {
    let analysis = run(log, ["", ""]).analysed();
    let wheels = analysis.machine.wheels().len();
    let otf =
        (0..wheels).flat_map(|wheel| analysis.rows.whole().outcomes.column(Quantity::Otf(wheel)));
    let least = otf
        .copied()
        .filter(|otf| otf.is_finite())
        .fold(f64::INFINITY, f64::min);
    let mean = analysis.machine.mass() * analysis.machine.gravity() / wheels as f64;
    let raised = format!("min_load = {:.0}.0", least + share * mean);
    run(log, ["", ""]).analysed_with(["min_load = 500.0", &raised])
}

impl Run {
    fn analysed(&self) -> Analysis {
        self.analysed_with(self.replaced)
    }

    fn analysed_with(&self, [from, to]: [&str; 2]) -> Analysis {
        let log = data(self.log);
        let machine = log.with_extension("toml");
        let text = std::fs::read_to_string(&machine).unwrap();
        assert!(text.contains(from), "{}", self.log);
        let text = if from.is_empty() {
            text
        } else {
            text.replacen(from, to, 1)
        };
        let file = MachineFile::from_text(&machine, &text).unwrap();
        analyse(&log, &file, Options::default(), &mut |_| {}).unwrap()
    }
}

/// The smallest margins of a window, from one evaluation per row.
#[derive(Debug)]
struct Least {
    otf: Vec<f64>,
    any_split: Vec<f64>,
    zmp: f64,
    moment: f64,
    rows: usize,
}

/// Evaluates the advised window one row at a time on a changed machine and changed states.
fn least(
    analysis: &Analysis,
    advice: &Advice,
    machine: &Machine,
    change: impl Fn(&mut State<f64>),
) -> Least {
    let machine = machine.with_imu_at_base();
    let mut workspace = Workspace::with_scope(&machine, Scope::LOADS);
    let wheels = machine.wheels().len();
    let mut found = Least {
        otf: vec![f64::INFINITY; wheels],
        any_split: vec![f64::INFINITY; wheels],
        zmp: f64::INFINITY,
        moment: f64::NEG_INFINITY,
        rows: 0,
    };
    for_each_state(analysis, advice, |state| {
        change(state);
        let outcome = evaluate(&machine, state, &mut workspace);
        assert!(outcome.otf.iter().all(|otf| otf.is_finite()));
        for wheel in 0..wheels {
            found.otf[wheel] = found.otf[wheel].min(outcome.otf[wheel]);
            found.any_split[wheel] = found.any_split[wheel].min(outcome.load_least[wheel]);
        }
        found.zmp = found.zmp.min(outcome.zmp_margin);
        found.moment = outcome
            .itom_full
            .iter()
            .copied()
            .fold(found.moment, f64::max);
        found.rows += 1;
    });
    found
}

/// States of the window with the motion of the base as the sensor's. The sensors of these logs are fixed to the base
/// with their axes, at r: f = f_imu - alpha x r - w x (w x r). While the machine tips, the base keeps its motion.
fn for_each_state(analysis: &Analysis, advice: &Advice, mut visit: impl FnMut(&mut State<f64>)) {
    let (machine, rows) = (&analysis.machine, &analysis.rows);
    assert_eq!(machine.imu().body, 0);
    let mount = &machine.imu().body_from_mount;
    assert!(mount.rotation.angle() < 1e-12);
    let r = mount.translation.vector;
    let mut state = State::zero(machine);
    let mut before: Option<State<f64>> = None;
    for row in 0..rows.len() {
        if !(advice.from_ns..=advice.to_ns).contains(&rows.times_ns[row]) {
            continue;
        }
        rows.whole().states.get(row, &mut state);
        let reasons = rows.reasons[row];
        if reasons.is_empty() {
            let imu = &mut state.imu;
            let (w, alpha) = (imu.angular_velocity, imu.angular_acceleration);
            imu.specific_force -= alpha.cross(&r) + w.cross(&w.cross(&r));
            before = Some(state.clone());
        } else if reasons.has(Reason::Tipping)
            && let Some(before) = &before
        {
            (state.imu, state.base) = (before.imu, before.base);
        } else {
            continue;
        }
        visit(&mut state);
    }
}

/// Forward velocity where the window begins (m/s).
fn entry_speed(analysis: &Analysis, advice: &Advice) -> f64 {
    let mut first = None;
    for_each_state(analysis, advice, |state| {
        first.get_or_insert(state.base.velocity.x);
    });
    first.unwrap()
}

/// The margins with an advised change, by formulas of this test.
fn with_change(analysis: &Analysis, advice: &Advice, advised: &SimulatedChange) -> Least {
    let machine = &analysis.machine;
    let change = advised.change;
    let k = 1.0 + change;
    let acceleration = |state: &State<f64>| {
        let (v, w) = (state.base.velocity, state.imu.angular_velocity);
        Vector3::new(state.base.velocity_rate.x, state.base.velocity_rate.y, 0.0)
            + w.cross(&Vector3::new(v.x, v.y, 0.0))
    };
    let slow = |state: &mut State<f64>| {
        for joint in &mut state.joints {
            joint.rate *= k;
            joint.acceleration *= k.powi(2);
        }
    };
    let mass = |parameter: Parameter| {
        least(
            analysis,
            advice,
            &machine.changed(&[(parameter, change)]),
            |_| {},
        )
    };
    match advised.of {
        Change::JointOffset(joint) => least(analysis, advice, machine, |state| {
            state.joints[joint].position += change;
        }),
        Change::SlowerArm => least(analysis, advice, machine, slow),
        Change::SlowerManoeuvre => least(analysis, advice, machine, |state| {
            slow(state);
            let a = acceleration(state);
            state.imu.specific_force -= a * (1.0 - k.powi(2));
            state.imu.angular_velocity *= k;
            state.imu.angular_acceleration *= k.powi(2);
        }),
        Change::LessForwardAcceleration => {
            let entry = entry_speed(analysis, advice);
            least(analysis, advice, machine, |state| {
                let before = acceleration(state);
                state.base.velocity.x = entry + k * (state.base.velocity.x - entry);
                state.base.velocity_rate.x *= k;
                let after = acceleration(state);
                state.imu.specific_force += after - before;
            })
        }
        Change::WiderCurve => least(analysis, advice, machine, |state| {
            let before = acceleration(state);
            state.imu.angular_velocity.z *= k;
            state.imu.angular_acceleration.z *= k;
            let after = acceleration(state);
            // the roll and pitch rates stay
            state.imu.specific_force += after - before;
        }),
        Change::LessPayload(payload) => mass(Parameter::PayloadMass(payload)),
        Change::LessLinkMass(link) => mass(Parameter::LinkMass(link)),
        Change::LessToolForce => least(analysis, advice, machine, |state| {
            state.tool_wrench.force *= k;
            state.tool_wrench.moment *= k;
        }),
    }
}

/// Every promise of every advised change. Returns the number of changes.
fn promises_hold(analysis: &Analysis) -> usize {
    let machine = &analysis.machine;
    let advice = analysis.advice.as_ref().expect("a wheel below its limit");
    let close = |a: f64, b: f64| (a - b).abs() < 1e-6 * machine.mass() * machine.gravity();
    let names: Vec<String> = machine
        .wheels()
        .iter()
        .map(|wheel| wheel.name.to_lowercase())
        .collect();
    let target = names.iter().position(|name| *name == advice.wheel).unwrap();
    let limit = analysis.min_loads_n.as_ref().unwrap();
    let logged = least(analysis, advice, machine, |_| {});
    assert_eq!(logged.rows, advice.rows);
    assert!(advice.from_ns <= advice.event_start_ns && advice.event_start_ns <= advice.worst_ns);
    for advised in &advice.changes {
        let found = with_change(analysis, advice, advised);
        let what = format!("{}: {found:?}", advised.statement);
        assert!(close(found.otf[target], advised.least_otf_n), "{what}");
        assert!(found.otf[target] >= limit[target] - 1e-6, "{what}");
        assert!(advised.residual_n >= 0.0, "{what}");
        let mut any_split = true;
        for (wheel, name) in names.iter().enumerate() {
            let margins = &advised.wheels[name];
            assert!(close(margins.otf_n.before, logged.otf[wheel]), "{what}");
            assert!(close(margins.otf_n.after, found.otf[wheel]), "{what}");
            assert_eq!(margins.limit_n, limit[wheel]);
            assert!(found.otf[wheel] >= limit[wheel] - 1e-3, "{what}");
            assert!(
                close(margins.any_split_n.after, found.any_split[wheel]),
                "{what}"
            );
            let needed = match logged.otf[wheel] < limit[wheel] {
                true => limit[wheel],
                false => limit[wheel].min(logged.any_split[wheel]),
            };
            any_split &= found.any_split[wheel] >= needed - 1e-3;
        }
        assert_eq!(advised.holds_under_any_split, any_split, "{what}");
        assert!(found.zmp >= logged.zmp - 1e-6, "{what}");
        assert!(found.moment <= logged.moment + 1e-3, "{what}");
        within_limits(analysis, advice, advised);
    }
    advice.changes.len()
}

/// The change stays within the limits of the URDF, the range of the log and the mass.
fn within_limits(analysis: &Analysis, advice: &Advice, advised: &SimulatedChange) {
    assert!(
        (0.0..=1.0).contains(&advised.effort),
        "{}",
        advised.statement
    );
    if let Change::JointOffset(joint) = advised.of
        && let Some([low, high]) = analysis.machine.joints()[joint].limits
    {
        for_each_state(analysis, advice, |state| {
            let position = state.joints[joint].position + advised.change;
            assert!(
                (low - 1e-9..=high + 1e-9).contains(&position),
                "{}",
                advised.statement
            );
        });
    }
}

#[test]
fn every_advised_change_holds_when_evaluated_independently() {
    let mut kinds = Vec::new();
    let lifts = LIFTS.iter().map(|run| (run.log, run.analysed()));
    let raised = DRIVING_AND_WORKING.iter();
    let raised = raised.map(|&(log, share)| (log, with_raised_limit(log, share)));
    for (log, analysis) in lifts.chain(raised) {
        let count = promises_hold(&analysis);
        println!("{log}: {count} changes");
        let advice = analysis.advice.unwrap();
        for advised in &advice.changes {
            println!("    {} ({:?})", advised.statement, advised.first_order);
            kinds.push(advised.of);
        }
        for tried in &advice.rejected {
            println!("    - {}: {}", tried.name, tried.reason);
        }
    }
    let has = |kind: fn(&Change) -> bool| kinds.iter().any(kind);
    assert!(has(|of| matches!(of, Change::JointOffset(_))));
    assert!(has(|of| matches!(of, Change::LessLinkMass(_))));
    assert!(has(|of| matches!(of, Change::SlowerManoeuvre)));
    assert!(has(|of| matches!(of, Change::LessForwardAcceleration)));
}

#[test]
fn the_base_keeps_its_motion_while_the_machine_tips() {
    let analysis = TIPPING.analysed();
    let advice = analysis.advice.as_ref().unwrap();
    assert!(advice.rows_held > 10, "{}", advice.rows_held);
    assert!(
        advice
            .assumptions
            .iter()
            .any(|text| text.contains("tipping"))
    );
    promises_hold(&analysis);
    let payload = advice
        .changes
        .iter()
        .find(|advised| advised.of == Change::LessPayload(0));
    let payload = payload.expect("without the payload the machine stood");
    assert!(payload.change < -400.0, "{}", payload.change);
}

/// The first derivative at the worst row advises changes that lift another wheel, that bring the machine nearer to an
/// edge, or that keep the wheel down only at that row.
#[test]
fn first_order_changes_that_do_not_hold_are_not_advised() {
    let (mut lifting, mut nearer) = (0, 0);
    let raised = with_raised_limit("tiny.mcap", 0.15);
    for analysis in LIFTS.iter().map(Run::analysed).chain([raised]) {
        let (machine, table) = (&analysis.machine, analysis.sensitivity.as_ref().unwrap());
        let advice = analysis.advice.as_ref().unwrap();
        let limit = analysis.min_loads_n.as_ref().unwrap();
        let logged = least(&analysis, advice, machine, |_| {});
        for row in table
            .rows
            .iter()
            .filter(|row| row.wheel == table.worst_wheel)
        {
            let Parameter::JointPosition(joint) = row.parameter else {
                continue;
            };
            let change = (limit[row.wheel] - row.worst_otf_n) / row.derivative;
            if !(change.abs() < 2.0) {
                continue;
            }
            let found = least(&analysis, advice, machine, |state| {
                state.joints[joint].position += change;
            });
            let lifts_another =
                (0..4).any(|wheel| found.otf[wheel] < limit[wheel].min(logged.otf[wheel]));
            let comes_nearer = found.zmp < logged.zmp - 1e-6;
            let is_too_small = found.otf[row.wheel] < limit[row.wheel] - 1.0;
            lifting += usize::from(lifts_another);
            nearer += usize::from(comes_nearer);
            if lifts_another || comes_nearer || is_too_small {
                let same = |advised: &&SimulatedChange| {
                    advised.of == Change::JointOffset(joint)
                        && (advised.change / change - 1.0).abs() < 1e-3
                };
                assert!(advice.changes.iter().find(same).is_none(), "{advice:?}");
            }
        }
    }
    assert!(lifting > 0 && nearer > 0, "{lifting} {nearer}");
    let swing = LIFTS[2].analysed().advice.unwrap();
    let mut rejected = swing.rejected.iter();
    let slew = rejected
        .find(|tried| tried.name == "slew.position (lower)")
        .unwrap();
    assert!(
        slew.reason.contains("wheel RL would fall to"),
        "{}",
        slew.reason
    );
}

#[test]
fn without_a_change_that_holds_the_finding_says_so() {
    let run = Run {
        log: "tiny.mcap",
        replaced: ["min_load = 500.0", "min_load = 6000.0"],
    };
    let analysis = run.analysed();
    let advice = analysis.advice.as_ref().unwrap();
    assert!(advice.changes.is_empty() && advice.rejected.len() > 5);
    let said = "no single change within limits would have kept every wheel at its limit";
    let findings = report::findings(&analysis);
    assert!(
        findings
            .iter()
            .any(|finding| finding.headline.contains(said)),
        "{findings:#?}"
    );
    let page = report::render(&analysis);
    assert!(page.contains("No single change within limits"));
}

#[test]
fn findings_name_the_split_under_which_advice_holds() {
    let analysis = LIFTS[0].analysed();
    let advice = analysis.advice.as_ref().unwrap();
    // a rigid machine on unknown ground: some split lifts a wheel whatever is changed
    assert!(
        advice
            .changes
            .iter()
            .all(|advised| !advised.holds_under_any_split)
    );
    let findings = report::findings(&analysis);
    let finding = findings
        .iter()
        .find(|finding| finding.headline.starts_with("Simulated:"))
        .unwrap();
    assert!(
        finding.headline.contains("under the stated load split"),
        "{finding}"
    );
    assert!(
        finding
            .evidence
            .iter()
            .any(|text| text.contains("stays as logged"))
    );
}

#[test]
fn a_log_without_an_event_has_no_advice() {
    let analysis = run("tiny.mcap", ["", ""]).analysed();
    assert!(
        analysis
            .events
            .iter()
            .all(|event| !event.kind.is_stability())
    );
    assert!(analysis.advice.is_none());
    // a wheel at its limit everywhere
    let otf = analysis.rows.whole().outcomes.column(Quantity::Otf(0));
    assert!(otf.iter().all(|otf| *otf > 500.0));
}
