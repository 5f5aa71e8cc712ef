//! Supports that come and go, compared with the contact forces of an independent simulator.

use std::fs;
use std::path::{Path, PathBuf};

use tipwatch_analyze::analysis::Analysis;
use tipwatch_analyze::base::options::Options;
use tipwatch_analyze::events::{Bound, Event, EventKind, ShownBy, Supposition};
use tipwatch_analyze::tables::parquet;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::state::Reason;
use tipwatch_mechanics::{Parameter, Quantity, Scope, State, Workspace, evaluate};
use tipwatch_tests::{analysed, analysed_with, data, write_edited, write_kept};

const WHEELS: [&str; 4] = ["fl", "fr", "rl", "rr"];
const FEET: [&str; 4] = ["ofl", "ofr", "orl", "orr"];

pub(crate) struct Truth {
    times_ns: Vec<i64>,
    loads: Vec<(String, Vec<f64>)>,
}

impl Truth {
    pub(crate) fn of(name: &str, supports: &[&str]) -> Self {
        let table = parquet::read(&data(&format!("{name}.truth.parquet"))).unwrap();
        let load = |support: &&str| {
            let loads = table.column(&format!("load_{support}")).unwrap();
            (support.to_string(), loads.numbers().unwrap().to_vec())
        };
        Self {
            times_ns: table.column("t_ns").unwrap().integers().unwrap().to_vec(),
            loads: supports.iter().map(load).collect(),
        }
    }

    fn at(&self, support: &str, time_ns: i64) -> f64 {
        let (_, loads) = self.loads.iter().find(|(name, _)| name == support).unwrap();
        let next = self.times_ns.partition_point(|&t| t < time_ns);
        let next = next.clamp(1, self.times_ns.len() - 1);
        let (a, b) = (self.times_ns[next - 1], self.times_ns[next]);
        let share = ((time_ns - a) as f64 / (b - a) as f64).clamp(0.0, 1.0);
        loads[next - 1] + share * (loads[next] - loads[next - 1])
    }

    /// The first time (s) between two times at which a load is zero.
    fn first_zero_s(&self, support: &str, from_s: f64, to_s: f64) -> f64 {
        let (_, loads) = self.loads.iter().find(|(name, _)| name == support).unwrap();
        let start = self.times_ns[0];
        let seconds = self.times_ns.iter().map(|&t| (t - start) as f64 * 1e-9);
        let mut both = seconds.zip(loads);
        let found = both.find(|&(t, &load)| t > from_s && t < to_s && load <= 0.0);
        found.unwrap().0
    }
}

fn support(analysis: &Analysis, name: &str) -> usize {
    let mut wheels = analysis.machine.wheels().iter();
    wheels.position(|w| w.name.to_lowercase() == name).unwrap()
}

/// Root mean square error of the loads over valid rows in a time (s), as a share of the mean load of that set.
pub(crate) fn error(
    analysis: &Analysis,
    truth: &Truth,
    supports: &[&str],
    [from_s, to_s]: [f64; 2],
) -> f64 {
    let (mut sum, mut count, mut weight) = (0.0, 0_usize, 0.0);
    for row in 0..analysis.rows.len() {
        let t = analysis.rows.seconds(row);
        if !(from_s..to_s).contains(&t) || !analysis.rows.reasons[row].is_empty() {
            continue;
        }
        for name in supports {
            let load = analysis
                .rows
                .whole()
                .value(Quantity::Load(support(analysis, name)), row);
            let true_n = truth.at(name, analysis.rows.times_ns[row]);
            sum += (load - true_n).powi(2);
            weight += true_n;
            count += 1;
        }
    }
    assert!(count > 400, "{count} loads between {from_s} and {to_s} s");
    (sum / count as f64).sqrt() / (weight / count as f64)
}

fn of_kind(analysis: &Analysis, kind: EventKind) -> Vec<&Event> {
    analysis.events.iter().filter(|e| e.kind == kind).collect()
}

fn start_s(analysis: &Analysis, event: &Event) -> f64 {
    (event.start_ns - analysis.rows.times_ns[0]) as f64 * 1e-9
}

/// The machine file of a fixture, edited, in a folder of its own.
fn edited(name: &str, edit: impl Fn(String) -> String) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let text = edit(fs::read_to_string(data(&format!("{name}.toml"))).unwrap());
    let urdf = format!("{name}.urdf");
    fs::copy(data(&urdf), folder.path().join(&urdf)).unwrap();
    let file = folder.path().join("machine.toml");
    fs::write(&file, text).unwrap();
    (folder, file)
}

/// The fixture without sensor noise.
fn without_noise(name: &str) -> Analysis {
    let (log, file) = (
        data(&format!("{name}_clean.mcap")),
        data(&format!("{name}.toml")),
    );
    analysed_with(&log, &file, Options::default())
}

fn crane_with(file: &Path) -> Analysis {
    analysed_with(&data("crane.mcap"), file, Options::default())
}

#[test]
fn val_loads_of_a_crane_follow_its_supports() {
    let analysis = analysed(&data("crane.mcap"), Options::default());
    let truth = Truth::of("crane", &[WHEELS, FEET].concat());
    let clean = without_noise("crane");
    // it drives on its wheels, works on its outriggers while one of them sinks, and drives on
    for (supports, time, most) in [
        (WHEELS, [0.6, 9.0], [0.001, 0.006]),
        (FEET, [12.5, 32.0], [0.005, 0.006]),
        (WHEELS, [35.5, 41.4], [0.001, 0.006]),
    ] {
        let shares = [&clean, &analysis].map(|found| error(found, &truth, &supports, time));
        let percent = shares.map(|share| 100.0 * share);
        println!(
            "{supports:?} {time:?}: {:.2} / {:.2} %",
            percent[0], percent[1]
        );
        assert!(
            shares[0] < most[0] && shares[1] < most[1],
            "{supports:?} {time:?}: {shares:?}"
        );
    }
    // a support that is off the ground has no load, no margin and no range
    for row in 0..analysis.rows.len() {
        let t = analysis.rows.seconds(row);
        let absent: &[&str] = match t {
            t if (12.5..32.0).contains(&t) => &WHEELS,
            t if !(9.0..=35.5).contains(&t) => &FEET,
            _ => continue,
        };
        for name in absent {
            let wheel = support(&analysis, name);
            for quantity in [
                Quantity::Load(wheel),
                Quantity::Otf(wheel),
                Quantity::LoadLargest(wheel),
            ] {
                let value = analysis.rows.whole().value(quantity, row);
                assert!(value.is_nan(), "{name} at {t} s: {quantity:?} {value}");
            }
        }
    }
}

#[test]
fn val_the_foot_that_lifts_is_found_and_jacking_is_no_event() {
    let analysis = analysed(&data("crane.mcap"), Options::default());
    let truth = Truth::of("crane", &FEET);
    let lifts = of_kind(&analysis, EventKind::WheelLift);
    // for six seconds the foot carries nothing, and the noise of its load crosses zero more than once
    assert!(
        !lifts.is_empty() && lifts.iter().all(|e| e.subject == "orr"),
        "{lifts:#?}"
    );
    let found_s = start_s(&analysis, lifts[0]);
    let true_s = truth.first_zero_s("orr", 12.0, 32.0);
    println!("lifts from {found_s:.2} s, in truth from {true_s:.2} s");
    assert!(
        (-0.5..2.0).contains(&(found_s - true_s)),
        "{found_s} s, in truth {true_s} s"
    );
    for lift in &lifts {
        assert!(start_s(&analysis, lift) < 27.5);
        // the jack itself shows nothing; a load that is computed to be nearly nothing would not be as certain
        let is_measured = lift.measured_load_n.is_some();
        assert_eq!(is_measured, lift.certainty.unwrap() > 0.95, "{lift:?}");
    }
    assert_eq!(of_kind(&analysis, EventKind::TipOver).len(), 0);
    assert_eq!(of_kind(&analysis, EventKind::EdgeTipping).len(), 0);
    // while it jacks, nothing is known
    let unknown = |from_s: f64, to_s: f64| {
        let rows = 0..analysis.rows.len();
        rows.filter(|&row| (from_s..to_s).contains(&analysis.rows.seconds(row)))
            .all(|row| analysis.rows.reasons[row].has(Reason::SupportsUnknown))
    };
    assert!(unknown(9.8, 10.7) && unknown(32.8, 33.3));
    let notes = analysis.notes.join("\n");
    assert!(notes.contains("On OFL, OFR, ORL, ORR for "), "{notes}");
    assert!(
        notes.contains("the weight passes from some supports to others"),
        "{notes}"
    );
}

#[test]
fn the_foot_that_lifts_is_asked_what_would_have_held_it() {
    let analysis = without_noise("crane");
    let lifts = of_kind(&analysis, EventKind::WheelLift);
    let [lift] = lifts.as_slice() else {
        panic!("{lifts:?}");
    };
    let suppositions = [
        Supposition::LevelGround,
        Supposition::HalfSpeed,
        Supposition::ArmIn,
    ];
    for supposed in suppositions {
        let asked = lift
            .counterfactuals
            .iter()
            .find(|it| it.supposed == supposed);
        let asked = asked.unwrap_or_else(|| panic!("{supposed:?}: {lift:?}"));
        assert!(
            asked.reply.otf_n.is_some() && asked.reply.sigma_n.is_some(),
            "{asked:?}"
        );
    }
    let advice = analysis.advice.as_ref().unwrap();
    assert_eq!(advice.wheel, "orr");
    assert!(advice.not_simulated.is_none(), "{advice:?}");
    assert!(
        advice.changes.len() + advice.rejected.len() > 2,
        "{advice:?}"
    );
}

#[test]
fn val_derivatives_of_a_foot_are_those_of_the_machine_on_its_feet() {
    let analysis = without_noise("crane");
    let table = analysis.sensitivity.as_ref().unwrap();
    assert_eq!(table.worst_wheel, support(&analysis, "orr"));
    let of_worst = table
        .rows
        .iter()
        .filter(|row| row.wheel == table.worst_wheel);
    let row = analysis.rows.at(table.ranked()[0].worst_ns);
    let machine = analysis.rows.machine_at(row).unwrap();
    let foot = machine
        .wheels()
        .iter()
        .position(|w| w.name == "ORR")
        .unwrap();
    let mut state = State::zero(machine);
    analysis.rows.state(row, &mut state);
    let otf = |machine: &Machine| {
        let mut workspace = Workspace::with_scope(machine, Scope::LOADS);
        evaluate(machine, &state, &mut workspace).otf[foot]
    };
    let mut compared = 0;
    for found in of_worst {
        // masses also move how much the measured forces count, which derivatives leave out
        let Parameter::LinkCom(..) = found.parameter else {
            continue;
        };
        let changed = |by: f64| otf(&machine.changed(&[(found.parameter, by)]));
        let difference = (changed(1e-3) - changed(-1e-3)) / 2e-3;
        assert!(
            (found.derivative - difference).abs() < 1e-6 * (1.0 + difference.abs()),
            "{found:?}: {difference}"
        );
        compared += 1;
    }
    assert!(compared > 2);
}

#[test]
fn without_forces_the_sinking_foot_is_within_the_envelope_only() {
    let (_folder, file) = edited("crane", |text| {
        let lines = text.lines().filter(|l| !l.starts_with("force"));
        lines.collect::<Vec<_>>().join("\n")
    });
    let analysis = crane_with(&file);
    let truth = Truth::of("crane", &FEET);
    let share = error(&analysis, &truth, &FEET, [12.5, 32.0]);
    assert!(share > 0.05, "{share}");
    let mut within = 0;
    let mut all = 0;
    for row in 0..analysis.rows.len() {
        let t = analysis.rows.seconds(row);
        if !(12.5..32.0).contains(&t) || !analysis.rows.is_valid(row) {
            continue;
        }
        for name in FEET {
            let wheel = support(&analysis, name);
            let value = |quantity| analysis.rows.whole().value(quantity, row);
            let (least, largest) = (
                value(Quantity::LoadLeast(wheel)),
                value(Quantity::LoadLargest(wheel)),
            );
            let slack = 3.0 * value(Quantity::LoadSigma(wheel));
            let true_n = truth.at(name, analysis.rows.times_ns[row]);
            all += 1;
            within += usize::from(true_n > least - slack && true_n < largest + slack);
        }
    }
    assert!(within as f64 > 0.99 * f64::from(all), "{within} of {all}");
    // what depends on the split says so
    for event in of_kind(&analysis, EventKind::WheelLift) {
        assert_eq!(event.split_dependent, Some(true), "{event:?}");
    }
}

// requirement: TW-VERDICT-14
#[test]
fn a_missing_support_signal_leaves_the_loads_unknown() {
    let (_folder, file) = edited("crane", |text| {
        text.replace("/outriggers/set", "/outriggers/gone")
    });
    let analysis = crane_with(&file);
    let all = 0..analysis.rows.len();
    assert!(
        all.clone()
            .all(|row| analysis.rows.reasons[row].has(Reason::SupportsUnknown))
    );
    assert!(all.clone().all(|row| {
        analysis
            .rows
            .whole()
            .value(Quantity::NormalForce, row)
            .is_nan()
    }));
    assert!(
        analysis
            .events
            .iter()
            .all(|e| e.kind != EventKind::WheelLift)
    );
    let notes = analysis.notes.join("\n");
    assert!(notes.contains("its signal cannot be read"), "{notes}");
}

#[test]
fn a_set_support_without_load_contradicts_equilibrium() {
    // the force of the foot that carries most reads zero
    let (_folder, file) = edited("crane", |text| {
        text.replace(
            r#"field = "data[2]" }"#,
            r#"field = "data[2]", scale = 1e-6 }"#,
        )
        .replace(
            r#"set = { topic = "/outriggers/set", field = "data[2]", scale = 1e-6 }"#,
            r#"set = { topic = "/outriggers/set", field = "data[2]" }"#,
        )
    });
    let analysis = crane_with(&file);
    let rows =
        (0..analysis.rows.len()).filter(|&row| (12.5..32.0).contains(&analysis.rows.seconds(row)));
    let rows: Vec<usize> = rows.collect();
    let told = rows.iter();
    let told = told.filter(|&&row| analysis.rows.reasons[row].has(Reason::SupportsUnknown));
    assert!(told.count() as f64 > 0.9 * rows.len() as f64);
}

#[test]
fn partly_jacked_the_range_over_all_splits_is_told() {
    // nobody logs that the wheels are free
    let (_folder, file) = edited("crane", |text| {
        let lines = text
            .lines()
            .filter(|l| !l.starts_with("raised") && !l.starts_with("force"));
        lines.collect::<Vec<_>>().join("\n")
    });
    let analysis = crane_with(&file);
    let notes = analysis.notes.join("\n");
    assert!(
        notes.contains("wheels and other supports carry together"),
        "{notes}"
    );
    let truth = Truth::of("crane", &FEET);
    let row = analysis.rows.at(analysis.rows.times_ns[0] + 21_000_000_000);
    for name in FEET {
        let wheel = support(&analysis, name);
        let value = |quantity| analysis.rows.whole().value(quantity, row);
        let true_n = truth.at(name, analysis.rows.times_ns[row]);
        assert!(value(Quantity::LoadLeast(wheel)) <= 0.0);
        assert!(value(Quantity::LoadLargest(wheel)) > true_n);
    }
    assert_eq!(of_kind(&analysis, EventKind::TipOver).len(), 0);
}

#[test]
fn spans_of_time_give_what_the_signals_give() {
    let (_folder, file) = edited("crane", |text| {
        let set =
            |i: usize| format!(r#"set = {{ topic = "/outriggers/set", field = "data[{i}]" }}"#);
        let text = (0..4).fold(text, |text, i| {
            text.replace(&set(i), "set = [[10.2, 33.3]]")
        });
        text.replace(
            r#"raised = { topic = "/outriggers/wheels_free", field = "data" }"#,
            r#"raised_by = ["OFL", "OFR", "ORL", "ORR"]"#,
        )
    });
    let analysis = crane_with(&file);
    let truth = Truth::of("crane", &FEET);
    let share = error(&analysis, &truth, &FEET, [12.5, 32.0]);
    assert!(share < 0.02, "{share}");
    let lifts = of_kind(&analysis, EventKind::WheelLift);
    assert!(
        !lifts.is_empty() && lifts.iter().all(|e| e.subject == "orr"),
        "{lifts:#?}"
    );
}

#[test]
fn val_forklift_on_three_points_lifts_its_uphill_front_wheel() {
    let analysis = analysed(&data("forklift.mcap"), Options::default());
    let truth = Truth::of("forklift", &WHEELS);
    let lift_s = truth.first_zero_s("fl", 0.0, 11.5);
    let clean = without_noise("forklift");
    let shares =
        [&clean, &analysis].map(|found| error(found, &truth, &WHEELS, [0.6, lift_s - 0.3]));
    let percent = shares.map(|share| 100.0 * share);
    println!(
        "forklift: {:.2} / {:.2} %, lifts at {lift_s} s",
        percent[0], percent[1]
    );
    assert!(shares[0] < 0.006 && shares[1] < 0.006, "{shares:?}");
    let lifts = of_kind(&analysis, EventKind::WheelLift);
    let first = lifts.first().unwrap();
    assert_eq!(first.subject, "fl");
    let found_s = start_s(&analysis, first);
    assert!(
        (found_s - lift_s).abs() < 0.3,
        "{found_s} s, in truth {lift_s} s"
    );
    // over its side it tips about the line from the front wheel to the pivot: the axle stays on the ground until its stop
    let stop_s = truth.first_zero_s("rl", 0.0, 11.5);
    let of_axle = analysis.events.iter().filter(|event| event.subject == "rl");
    for event in of_axle {
        let found_s = start_s(&analysis, event);
        assert!(found_s > stop_s - 0.3, "{event:?}, in truth {stop_s} s");
        // where the load of a wheel on that axle is not seen to fall, it left the ground then or earlier
        if event.kind == EventKind::WheelLift && event.start_sigma_s.is_none() {
            assert_eq!(event.start_bound, Bound::AtOrBefore, "{event:?}");
        }
    }
    let fall = of_kind(&analysis, EventKind::TipOver);
    assert_eq!(fall[0].shown_by, Some(ShownBy::Both));
    // and the moment about the edge weighs nothing
    assert!(analysis.explained_falls.is_empty());
}

/// On the stop that it turns on to, a machine stands with a wheel in the air, and the load about the line to the pivot of its axle is
/// below zero. Elsewhere nothing holds it so: the loads are wrong.
#[test]
fn a_machine_that_stands_on_the_stop_of_its_axle_has_a_wheel_in_the_air() {
    let folder = tempfile::tempdir().unwrap();
    let [part, log] = ["part.mcap", "stands.mcap"].map(|name| folder.path().join(name));
    let until_ns = Truth::of("forklift", &WHEELS).times_ns[0] + 1_900_000_000;
    write_kept(&data("forklift.mcap"), &part, &|_, time_ns| {
        time_ns < until_ns
    });
    for (axle_rad, is_on_stop) in [(-0.0523, true), (0.0, false), (0.0523, false)] {
        write_edited(&part, &log, &mut |topic, values| match topic {
            "/joint_states" => {
                values.set("position.pendulum_axle", axle_rad);
                values.shift("position.lift", 1.6);
            }
            "/imu/data" => values.roll(10_f64.to_radians()),
            _ => (),
        });
        let analysis = analysed_with(&log, &data("forklift.toml"), Options::default());
        let lifts = of_kind(&analysis, EventKind::WheelLift);
        let lift = lifts.iter().find(|event| event.subject == "fl").unwrap();
        assert_eq!(lift.doubt.is_none(), is_on_stop, "{axle_rad}: {lift:?}");
        let is_certain = lift.certainty.is_some_and(|p| p > 0.99);
        assert_eq!(is_certain, is_on_stop, "{axle_rad}: {lift:?}");
    }
}

#[test]
fn the_analytic_models_refuse_supports_that_come_and_go() {
    use tipwatch_analyze::analysis::run::analyse;
    use tipwatch_analyze::base::options::ModelKind;
    use tipwatch_binding::MachineFile;
    let file = MachineFile::read(&data("crane.toml")).unwrap();
    let options = Options {
        model: ModelKind::ClosedForm,
        ..Options::default()
    };
    let error = analyse(&data("crane.mcap"), &file, options, &mut |_| {}).unwrap_err();
    let text = format!("{error:#}");
    assert!(text.contains("supports that come and go"), "{text}");
}

/// On outriggers nothing compares the lean of the platform with the motion of the arm: one encoder in a hundred is reversed.
#[test]
fn on_outriggers_a_load_is_as_certain_as_signs_that_nothing_has_tested() {
    let analysis = analysed(&data("crane.mcap"), Options::default());
    let light = of_kind(&analysis, EventKind::WheelLight);
    let [by_loads] = light[..] else {
        panic!("{light:?}")
    };
    let signs: Vec<(&str, f64)> = (by_loads.untested.iter())
        .map(|sign| (sign.joint.as_str(), sign.reversed))
        .collect();
    assert_eq!(signs, [("slew", 0.01)]);
    let certainty = by_loads.certainty.unwrap();
    assert!((0.98..0.995).contains(&certainty), "{certainty}");
    // the jack that measures its own load rests on no encoder
    let lifts = of_kind(&analysis, EventKind::WheelLift);
    assert!(
        lifts[0].measured_load_n.is_some() && lifts[0].untested.is_empty(),
        "{lifts:?}"
    );
}
