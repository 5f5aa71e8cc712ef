//! Measured loads of a machine whose supports come and go: a crane on wheels and outriggers, with what its simulator says.

use std::fs;
use std::path::PathBuf;

use tempfile::TempDir;
use tipwatch_analyze::analysis::measured_loads::{Contradiction, TOTAL};
use tipwatch_analyze::analysis::{Analysis, Undecided};
use tipwatch_analyze::base::options::{Estimator, Options};
use tipwatch_analyze::events::{Event, EventKind, Finding};
use tipwatch_analyze::report;
use tipwatch_analyze::setup::identify::{Request, identify};
use tipwatch_analyze::setup::validate::{Validation, validate};
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::state::Reason;
use tipwatch_tests::{analysed_with, data};

use crate::measured_loads::{WHEELS, cells, with_loads};
use crate::sparse::{every, thinned};
use crate::supports::{Truth, error};

const FEET: [&str; 4] = ["ofl", "ofr", "orl", "orr"];

/// Returns load cells of the four jacks, bound to the fields that the machine file of the fixture binds as their forces.
fn jack_cells() -> String {
    let cell = |(k, foot): (usize, &str)| {
        format!(
            "[signals.wheels.{foot}]\nload = {{ topic = \"/outriggers/force\", field = \"data[{k}]\" }}\nsigma = 200.0\n"
        )
    };
    let feet = ["OFL", "OFR", "ORL", "ORR"].into_iter().enumerate();
    feet.map(cell).collect()
}

fn front_axle() -> &'static str {
    "[[signals.load_sums]]\nname = \"front left and rear left\"\nwheels = [\"FL\", \"RL\"]\nsigma = 100.0\n\
     load = { topic = \"/wheel_loads\", field = \"fl\", scale = 2.0 }\n"
}

/// The crane with load cells under everything, a machine file with `more`, and an edited URDF.
struct Crane {
    _folder: TempDir,
    log: PathBuf,
    machine: PathBuf,
}

impl Crane {
    fn new(edit: impl Fn(String) -> String, urdf: impl Fn(String) -> String) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let read = |name: &str| fs::read_to_string(data(name)).unwrap();
        fs::write(folder.path().join("crane.urdf"), urdf(read("crane.urdf"))).unwrap();
        let machine = folder.path().join("crane.toml");
        fs::write(&machine, edit(read("crane.toml"))).unwrap();
        Self {
            log: with_loads(folder.path(), &data("crane.mcap"), |_, loads| loads),
            machine,
            _folder: folder,
        }
    }

    fn file(&self) -> MachineFile {
        MachineFile::read(&self.machine).unwrap()
    }

    fn validated(&self, estimator: Estimator) -> Validation {
        validate(&self.file(), std::slice::from_ref(&self.log), estimator).unwrap()
    }

    fn analysed(&self) -> Analysis {
        analysed_with(&self.log, &self.machine, Options::default())
    }
}

fn same(text: String) -> String {
    text
}

/// Returns the machine file without the forces of the jacks, which the computed loads would follow.
fn without_forces(text: String) -> String {
    let lines = text.lines().filter(|line| !line.starts_with("force"));
    lines.collect::<Vec<_>>().join("\n") + "\n"
}

/// The simulated jacks have none.
fn without_friction(text: String) -> String {
    text.replace(
        "force_sigma = 200.0",
        "force_sigma = 200.0\nfriction_share = 0.0",
    )
}

/// A platform that weighs less than in truth (kg).
fn lighter(by: f64) -> impl Fn(String) -> String {
    move |urdf| {
        let (before, after) = (7000.0, 7000.0 - by);
        let found = [
            format!("value=\"{before}\""),
            format!("value=\"{before:.1}\""),
        ];
        let found = found.iter().find(|text| urdf.contains(*text));
        let found = found.unwrap_or_else(|| panic!("{urdf}"));
        urdf.replacen(found, &format!("value=\"{after}\""), 1)
    }
}

fn seconds(analysis: &Analysis, time_ns: i64) -> f64 {
    (time_ns - analysis.rows.times_ns[0]) as f64 * 1e-9
}

#[test]
fn every_sensor_is_compared_with_its_own_supports() {
    let more = cells(100.0) + &jack_cells() + front_axle();
    let crane = Crane::new(|text| without_forces(text) + &more, same);
    let found = crane.validated(Estimator::Smoother);
    assert!(found.has_compared(), "{found:?}");
    let sensors = &found.logs[0].sensors;
    assert_eq!(sensors.len(), 9);
    for sensor in sensors {
        assert!(sensor.rows > 100, "{sensor:?}");
        let share = sensor.bias_n.unwrap().abs() / sensor.mean_measured_n.unwrap();
        // the sum is bound to twice one wheel
        let most = match sensor.sensor.as_str() {
            foot if FEET.contains(&foot) => continue,
            wheel if wheel.len() == 2 => 0.01,
            _ => 0.2,
        };
        assert!(share < most, "{sensor:?}");
    }
    // The ground under the foot at the rear right sinks, until it carries nothing. That moves load from one diagonal to the
    // other, half the weight in the end, which no equation of equilibrium tells. What is left beside it is small.
    let feet = FEET.map(|foot| sensors.iter().find(|s| s.sensor == foot).unwrap());
    let biases = feet.map(|foot| foot.bias_n.unwrap());
    let mean = feet
        .iter()
        .map(|foot| foot.mean_measured_n.unwrap())
        .sum::<f64>()
        / 4.0;
    let [ofl, ofr, orl, orr] = biases;
    let diagonal = 0.25 * (ofl - ofr - orl + orr);
    assert!(diagonal < -0.2 * mean, "{biases:?}");
    for (foot, sign) in [ofl, ofr, orl, orr].into_iter().zip([1.0, -1.0, -1.0, 1.0]) {
        let left = foot - sign * diagonal;
        assert!(left.abs() < 0.01 * mean, "{biases:?}: {left}");
    }
    // wheels in the time on wheels, feet in the time on feet
    let rows = &found.logs[0].sensors;
    assert!(rows[0].rows < 1500 && rows[0].rows + rows[4].rows < 2000);
    for wheel in WHEELS {
        assert!(sensors.iter().any(|s| s.sensor == wheel.to_lowercase()));
    }
}

#[test]
fn a_true_crane_stays_as_it_is_and_a_wrong_one_is_corrected() {
    let more = cells(100.0) + &jack_cells();
    for (by, most) in [(0.0, 60.0), (300.0, 120.0)] {
        let sheet = "mass_share = 0.05";
        let edit = |text: String| without_forces(text).replace("mass_share = 0.005", sheet) + &more;
        let crane = Crane::new(edit, lighter(by));
        let request = Request {
            logs: vec![crane.log.clone()],
            ..Request::default()
        };
        let found = identify(&crane.file(), &request).unwrap();
        let identified = (found.machine).with_identified(found.result.identified.clone());
        let off = identified.mass() - found.machine.mass() - by;
        assert!(off.abs() < most, "{by}: {off}");
        assert!(found.result.bands.unwrap().excess.unwrap() < 3.0);
    }
}

#[test]
fn jacks_that_carry_more_than_the_weight_tell_the_load_that_is_not_stated() {
    let crane = Crane::new(same, lighter(2500.0));
    let analysis = crane.analysed();
    let spans = &analysis.load_comparison.contradictions;
    let span = spans.iter().find(|span| span.sensor == TOTAL).unwrap();
    let load = span.unstated.unwrap();
    assert!(
        (load.mass_kg - 2500.0).abs() < 2.0 * load.mass_sigma_kg,
        "{load:?}"
    );
    assert!(load.mass_sigma_kg < 600.0, "{load:?}");
    // the mass is missing in the platform, whose centre of mass is at its origin
    let (at, sigma) = (load.at_m.unwrap(), load.at_sigma_m.unwrap());
    for axis in 0..2 {
        assert!(at[axis].abs() < 2.0 * sigma[axis].max(0.1), "{load:?}");
    }
    let notes = analysis.notes.join("\n");
    assert!(notes.contains("kg that is not stated"), "{notes}");
    let contradicted = (0..analysis.rows.len())
        .filter(|&row| (14.0..30.0).contains(&analysis.rows.seconds(row)))
        .filter(|&row| analysis.rows.reasons[row].has(Reason::Contradiction));
    assert!(contradicted.count() > 500);
    // true jacks of a true machine contradict nothing
    let crane = Crane::new(same, same);
    let contradictions = crane.analysed().load_comparison.contradictions;
    assert!(contradictions.is_empty(), "{contradictions:?}");
}

#[test]
fn a_load_on_the_hook_that_is_not_stated_is_in_the_loads() {
    // 1000 of the 1400 kg on the hook are not stated
    let hook = |urdf: String| urdf.replacen("value=\"1400\"", "value=\"400\"", 1);
    let crane = Crane::new(without_friction, hook);
    let analysis = crane.analysed();
    let spans = &analysis.load_comparison.contradictions;
    let span = spans.iter().find(|span| span.sensor == TOTAL).unwrap();
    let load = span.unstated.unwrap();
    assert!(load.at_tool && span.is_explained(), "{load:?}");
    assert!(
        (load.mass_kg - 1000.0).abs() < 2.0 * load.mass_sigma_kg,
        "{load:?}"
    );
    let (from, to) = (
        seconds(&analysis, span.start_ns),
        seconds(&analysis, span.end_ns),
    );
    assert!(to - from > 10.0, "{from} to {to}");
    let rows = &analysis.rows;
    let within = |row: &usize| (from..=to).contains(&rows.seconds(*row));
    for row in (0..rows.len()).filter(within) {
        assert!(!rows.reasons[row].has(Reason::Contradiction), "{row}");
    }
    // the jacks' errors alone are left
    let truth = Truth::of("crane", &FEET);
    let with = error(&analysis, &truth, &FEET, [from, to]);
    assert!(with < 0.012, "{with}");
    // without jacks that measure, the loads are those of what is stated
    let blind = Crane::new(without_forces, hook).analysed();
    let without = error(&blind, &truth, &FEET, [from, to]);
    assert!(without > 5.0 * with, "{without} {with}");
}

/// The sum of jacks whose friction is not known shows 500 kg at the end of the boom to 2 sigma; their moments show it to 7.
#[test]
fn moments_show_a_load_on_the_hook_that_the_sum_does_not() {
    let lighter = |by: f64| {
        move |urdf: String| {
            urdf.replacen("value=\"1400\"", &format!("value=\"{}\"", 1400.0 - by), 1)
        }
    };
    let known = |analysis: &Analysis| {
        let reasons = analysis.rows.reasons.iter();
        reasons.filter(|reasons| reasons.leave_loads()).count()
    };
    let sound = known(&Crane::new(same, same).analysed());
    for missing_kg in [500.0, 1000.0] {
        let analysis = Crane::new(same, lighter(missing_kg)).analysed();
        let spans = &analysis.load_comparison.contradictions;
        assert!(!spans.is_empty());
        for span in spans {
            let load = span.unstated.unwrap();
            assert!(span.is_explained(), "{span:?}");
            assert!(
                (load.mass_kg - missing_kg).abs() < 2.0 * load.mass_sigma_kg,
                "{load:?}"
            );
            assert!(2.0 * load.mass_sigma_kg < 0.35 * missing_kg, "{load:?}");
        }
        // no row is lost to it
        assert_eq!(known(&analysis), sound, "{missing_kg}");
    }
    // 300 kg, while the boom is over one foot: a wrong sensor of that foot would do the same
    let analysis = Crane::new(same, lighter(300.0)).analysed();
    let spans = &analysis.load_comparison.contradictions;
    assert!(spans.iter().all(|span| !span.is_explained()), "{spans:?}");
    assert_eq!(known(&analysis), sound);
}

/// A field of the jacks' forces that is edited in the machine file.
fn with_force(text: &str, k: usize, edited: &str) -> String {
    let field = format!("force = {{ topic = \"/outriggers/force\", field = \"data[{k}]\" }}");
    assert!(text.contains(&field));
    text.replace(
        &field,
        &format!("force = {{ topic = \"/outriggers/force\", {edited} }}"),
    )
}

/// The certainty of the surest lift of a support.
fn lift_certainty(analysis: &Analysis, foot: &str) -> f64 {
    let lifts = lifts(analysis)
        .into_iter()
        .filter(|event| event.subject == foot);
    lifts
        .filter_map(|event| event.certainty)
        .fold(0.0, f64::max)
}

#[test]
fn dead_cells_are_no_fall_and_no_lift() {
    // both on the left, and all
    for dead in [&[0, 2][..], &[0, 1, 2, 3]] {
        let edit = |text: String| {
            dead.iter().fold(text, |text, &k| {
                with_force(&text, k, &format!("field = \"data[{k}]\", scale = 1e-6"))
            })
        };
        let analysis = Crane::new(edit, same).analysed();
        let spans = &analysis.load_comparison.contradictions;
        assert!(!spans.iter().any(Contradiction::is_followed), "{spans:?}");
        for event in &analysis.events {
            let is_fall = matches!(event.kind, EventKind::EdgeTipping | EventKind::TipOver);
            assert!(!is_fall || event.certainty < Some(0.5), "{event:?}");
        }
        for &k in dead {
            let foot = FEET[k];
            let certainty = lift_certainty(&analysis, foot);
            // the rear right foot does leave the ground, and nothing that measures says so
            assert!(certainty < 0.5, "{foot} {certainty}");
        }
    }
}

#[test]
fn exchanged_cells_are_named_and_lift_no_support_for_sure() {
    let edit = |text: String| {
        let text = with_force(&text, 2, "field = \"data[33]\"");
        let text = with_force(&text, 3, "field = \"data[2]\"");
        text.replace("data[33]", "data[3]")
    };
    let analysis = Crane::new(edit, same).analysed();
    let spans = &analysis.load_comparison.contradictions;
    let named = spans.iter().filter_map(|span| span.exchanged.clone());
    assert!(named.clone().count() > 0, "{spans:?}");
    for pair in named {
        assert_eq!(pair, ["ORL", "ORR"]);
    }
    assert!(!spans.iter().any(Contradiction::is_followed), "{spans:?}");
    for foot in FEET {
        let certainty = lift_certainty(&analysis, foot);
        assert!(certainty < 0.6, "{foot} {certainty}");
    }
}

#[test]
fn a_support_that_carries_is_not_taken_for_one_that_is_not_set() {
    let edit = |text: String| {
        text.replace(
            "set = { topic = \"/outriggers/set\", field = \"data[0]\" }",
            "set = { topic = \"/outriggers/set\", field = \"data[0]\", above = 2.0 }",
        )
    };
    let analysis = Crane::new(edit, same).analysed();
    let rows = &analysis.rows;
    let jacked = (0..rows.len()).filter(|&row| (13.0..31.0).contains(&rows.seconds(row)));
    for row in jacked {
        assert!(rows.reasons[row].has(Reason::SupportsUnknown), "{row}");
    }
    let notes = analysis.notes.join("\n");
    assert!(notes.contains("OFL is reported as not set"), "{notes}");
}

/// Jacks that are logged twice a second show the load, too, and the loads of the rows between follow their last sample.
#[test]
fn slow_jacks_are_followed_by_their_last_sample() {
    let hook = |urdf: String| urdf.replacen("value=\"1400\"", "value=\"200\"", 1);
    let crane = Crane::new(without_friction, hook);
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("slow.mcap");
    let mut is_due = every(0.5, 0.0);
    thinned(&crane.log, &log, &mut |topic, t| {
        topic != "/outriggers/force" || is_due(topic, t)
    });
    let analysis = analysed_with(&log, &crane.machine, Options::default());
    let spans = &analysis.load_comparison.contradictions;
    let span = spans.iter().find(|span| span.is_explained());
    let span = span.unwrap_or_else(|| panic!("{spans:?}"));
    let load = span.unstated.unwrap();
    assert!(
        (load.mass_kg - 1200.0).abs() < 2.0 * load.mass_sigma_kg,
        "{load:?}"
    );
    let [from, to] = [span.start_ns, span.end_ns].map(|ns| seconds(&analysis, ns));
    let truth = Truth::of("crane", &FEET);
    let with = error(&analysis, &truth, &FEET, [from, to]);
    // half a second of slewing is left
    let blind = Crane::new(without_forces, hook).analysed();
    let without = error(&blind, &truth, &FEET, [from, to]);
    assert!(without > 2.0 * with, "{without} {with}");
}

/// The finding whose headline contains a text.
fn finding<'f>(findings: &'f [Finding], text: &str) -> &'f Finding {
    let found = findings.iter().find(|it| it.headline.contains(text));
    found.unwrap_or_else(|| panic!("{text}: {findings:?}"))
}

#[test]
fn measured_loads_that_contradict_the_computed_ones_are_a_finding_with_its_bands() {
    let hook = |urdf: String| urdf.replacen("value=\"1400\"", "value=\"400\"", 1);
    for (urdf, consequence) in [
        (&hook as &dyn Fn(String) -> String, "and so include it"),
        (
            &lighter(2500.0) as &dyn Fn(String) -> String,
            "either may be wrong",
        ),
    ] {
        let analysis = Crane::new(without_friction, urdf).analysed();
        let span = &analysis.load_comparison.contradictions[0];
        let load = span.unstated.unwrap();
        // among the first three, which the terminal prints, and in the summary
        let findings = report::main_findings(&analysis);
        let told = finding(&findings[..3], "the sum of the measured loads is");
        let mass = format!(
            "a load of {:.0} ± {:.0} kg that is not stated",
            load.mass_kg,
            2.0 * load.mass_sigma_kg
        );
        assert!(told.headline.contains(&mass), "{told}");
        assert!(told.evidence[0].contains(consequence), "{told}");
        let text = told.to_string();
        assert_eq!(
            load.at_tool,
            text.contains("acts where the arm carries loads"),
            "{text}"
        );
        // a load that the arm moves has no one place, and no sentence has a key of the machine file
        assert_eq!(load.at_tool, !text.contains("at x = "), "{text}");
        assert!(!text.contains("[["), "{text}");
    }
    // true jacks of a true machine
    let findings = report::findings(&Crane::new(same, same).analysed());
    let contradicts = |it: &&Finding| it.headline.contains("measured loads");
    assert_eq!(
        findings.iter().find(contradicts).map(ToString::to_string),
        None
    );
}

#[test]
fn a_crane_is_asked_for_nothing_that_its_log_has() {
    let analysis = Crane::new(same, same).analysed();
    let findings = report::findings(&analysis);
    // the jacks tell the split while it stands on them, and nothing does while it stands on its wheels
    let open = finding(&findings, "it cannot be excluded that wheel FL");
    assert_eq!(
        open.evidence.last().unwrap(),
        "To decide it: weighing the wheels where the machine stood; or stating flat ground and the stiffness of the tyres \
         in the machine file, if the ground was flat"
    );
    let page = report::render(&analysis);
    for asked in ["pressures", "more exact measured loads"] {
        assert!(!page.contains(asked), "{asked}");
    }
    assert!(page.contains("weighing or known flat ground would decide"));
    assert!(page.contains("load split: by the measured forces of OFL, OFR, ORL, ORR, elsewhere all supports are springs"));
    for refused in ["always on the same supports", "The chosen model does not"] {
        assert!(!page.contains(refused), "{refused}");
    }
}

#[test]
fn events_of_an_outrigger_are_not_called_after_a_wheel() {
    let analysis = Crane::new(same, same).analysed();
    let page = report::render(&analysis);
    assert!(page.contains("<td>support lift</td>"));
    assert!(!page.contains("<td>wheel lift") && !page.contains("<td>wheel light"));
    // the names that programs read stay
    assert!(
        analysis
            .events
            .iter()
            .any(|event| event.kind.name() == "wheel_lift")
    );
}

#[test]
fn one_wrong_jack_is_not_followed() {
    // the front left jack shows 20 kN too much
    let offset = |text: String| {
        without_friction(text).replacen(
            "force = { topic = \"/outriggers/force\", field = \"data[0]\" }",
            "force = { topic = \"/outriggers/force\", field = \"data[0]\", offset = 20000.0 }",
            1,
        )
    };
    let analysis = Crane::new(offset, same).analysed();
    let spans = &analysis.load_comparison.contradictions;
    let span = spans.iter().find(|span| span.sensor == TOTAL).unwrap();
    let load = span.unstated.unwrap();
    assert!(load.at_support && !load.followed, "{load:?}");
    assert!(!span.is_followed() && !span.is_explained());
    assert!(span.explanation().contains("wrong sensor of the support"));
}

fn lifts(analysis: &Analysis) -> Vec<&Event> {
    let events = analysis.events.iter();
    events.filter(|e| e.kind == EventKind::WheelLift).collect()
}

#[test]
fn a_jack_that_measures_nothing_is_off_the_ground_whatever_is_computed() {
    // in truth the rear right foot carries nothing from 21 to 27 s
    for by in [0.0, 2500.0] {
        let analysis = Crane::new(same, lighter(by)).analysed();
        let lifts = lifts(&analysis);
        let lift = lifts.iter().max_by(|a, b| {
            let length = |e: &Event| e.end_ns.unwrap_or(i64::MAX) - e.start_ns;
            length(a).cmp(&length(b))
        });
        let lift = lift.unwrap_or_else(|| panic!("{by}: no lift"));
        assert_eq!(lift.subject, "orr");
        assert_eq!(lift.split_dependent, Some(false));
        // the sensor's own error of 200 N says so, not that of the computed load
        assert!(lift.certainty.unwrap() > 0.95, "{lift:?}");
        assert_eq!(lift.certainty, lift.certainty_any_split);
        assert!(lift.measured_load_n.unwrap().abs() < 200.0, "{lift:?}");
        let [least, most] = lift.load_range_n.unwrap();
        assert!(least == 0.0 && most < 700.0, "{lift:?}");
        let findings = report::findings(&analysis);
        let first = finding(&findings, "Support ORR was off the ground");
        let evidence = first.evidence.join("\n");
        assert!(
            evidence.contains("The load sensor of this support showed"),
            "{evidence}"
        );
        let (start, end) = (
            seconds(&analysis, lift.start_ns),
            seconds(&analysis, lift.end_ns.unwrap()),
        );
        assert!(start < 22.5 && end > 25.5, "{by}: {start} to {end}");
    }
}

#[test]
fn the_range_of_an_unloaded_jack_is_what_its_measurement_leaves() {
    let analysis = Crane::new(same, same).analysed();
    let wheels = analysis.machine.wheels();
    let orr = wheels.iter().position(|wheel| wheel.name == "ORR").unwrap();
    let mut narrow = 0;
    for row in 0..analysis.rows.len() {
        let value = |quantity| analysis.rows.whole().value(quantity, row);
        let on_feet = (23.0..26.0).contains(&analysis.rows.seconds(row));
        if !on_feet || !(value(Quantity::Load(orr)) <= 0.0) {
            continue;
        }
        narrow += 1;
        let (least, largest) = (
            value(Quantity::LoadLeast(orr)),
            value(Quantity::LoadLargest(orr)),
        );
        assert!(
            least >= 0.0 && largest < 1500.0,
            "row {row}: {least} {largest}"
        );
    }
    assert!(narrow > 20, "{narrow}");
}

#[test]
fn a_causal_estimate_and_a_sparse_log_are_validated() {
    let more = cells(100.0) + &jack_cells();
    let crane = Crane::new(|text| without_forces(text) + &more, same);
    let causal = crane.validated(Estimator::Causal);
    assert!(
        causal.has_compared() && !causal.is_contradicted(),
        "{causal:?}"
    );
    // one message of each topic in a second
    let folder = tempfile::tempdir().unwrap();
    let sparse = folder.path().join("sparse.mcap");
    thinned(&crane.log, &sparse, &mut every(1.0, 0.0));
    let text = fs::read_to_string(&crane.machine).unwrap();
    let aged = |line: &str| match line.starts_with("set =") || line.starts_with("raised =") {
        true => line.replace(" }", ", max_age = 4.0 }"),
        false => line.to_owned(),
    };
    let text: Vec<String> = text.lines().map(aged).collect();
    fs::write(&crane.machine, text.join("\n")).unwrap();
    let found = validate(&crane.file(), &[sparse], Estimator::Smoother).unwrap();
    assert!(
        found.has_compared() && !found.is_contradicted(),
        "{found:?}"
    );
    let notes = found.logs[0].notes.join("\n");
    assert!(
        notes.contains("Rows without neighbours are static"),
        "{notes}"
    );
}

/// The crane with its jacks logged once in a time (s), in a file of its own.
fn with_slow_jacks(period_s: f64) -> Analysis {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("slow.mcap");
    let mut is_due = every(period_s, 0.0);
    thinned(&data("crane.mcap"), &log, &mut |topic, t| {
        topic != "/outriggers/force" || is_due(topic, t)
    });
    analysed_with(&log, &data("crane.toml"), Options::default())
}

#[test]
fn forces_that_no_row_uses_leave_the_log_undecided() {
    assert_eq!(with_slow_jacks(0.1).undecided(0.5), None);
    for period_s in [0.5, 1.0] {
        let found = with_slow_jacks(period_s).undecided(0.5);
        assert_eq!(found, Some(Undecided::UnusedForces { count: 4 }));
        assert!(found.unwrap().to_string().contains("max_gap"));
    }
}

/// Returns start and end (s) of the time in which the rear right jack carries nothing by its own sensor.
fn measured_lift(analysis: &Analysis) -> [f64; 2] {
    let mut events = analysis.events.iter();
    let found = events.find(|event| {
        event.kind == EventKind::WheelLift
            && event.subject == "orr"
            && event.measured_load_n.is_some()
    });
    let found = found.unwrap_or_else(|| panic!("{:?}", analysis.events));
    [found.start_ns, found.end_ns.unwrap()].map(|ns| seconds(analysis, ns))
}

#[test]
fn a_jack_that_measures_nothing_is_told_at_any_rate() {
    let whole = measured_lift(&analysed_with(
        &data("crane.mcap"),
        &data("crane.toml"),
        Options::default(),
    ));
    for period_s in [0.5, 1.0] {
        let found = measured_lift(&with_slow_jacks(period_s));
        for (found_s, true_s) in found.into_iter().zip(whole) {
            assert!(
                (found_s - true_s).abs() < 1.5 * period_s,
                "{found:?} {whole:?}"
            );
        }
    }
}

/// A jack that has shown one value only since it was switched on is no foot in the air, however small the value.
#[test]
fn a_slow_jack_that_nothing_shows_to_be_measured_lifts_nothing() {
    let force = "force = { topic = \"/outriggers/force\", field = \"data[3]\"";
    let crane = Crane::new(
        |text| text.replace(force, &format!("{force}, scale = 1e-30, offset = 10.0")),
        same,
    );
    let folder = tempfile::tempdir().unwrap();
    let slow = folder.path().join("slow.mcap");
    let mut is_due = every(1.0, 0.0);
    thinned(&crane.log, &slow, &mut |topic, t| {
        topic != "/outriggers/force" || is_due(topic, t)
    });
    let analysis = analysed_with(&slow, &crane.machine, Options::default());
    let is_measured = |event: &&Event| event.subject == "orr" && event.measured_load_n.is_some();
    let found = analysis.events.iter().find(is_measured);
    assert!(found.is_none(), "{found:?}");
}

#[test]
fn a_load_cell_that_measures_nothing_shows_the_lift_as_the_force_of_a_jack_does() {
    let by_force = measured_lift(&Crane::new(same, same).analysed());
    let by_cell = Crane::new(|text| without_forces(text) + &jack_cells(), same).analysed();
    let found = measured_lift(&by_cell);
    for (found_s, true_s) in found.into_iter().zip(by_force) {
        assert!((found_s - true_s).abs() < 0.1, "{found:?} {by_force:?}");
    }
}

/// Without a switch, a jack that carries nothing while the others stand is lifted, not taken back.
#[test]
fn a_jack_without_a_switch_is_lifted_as_one_with_it() {
    let without_switch = |text: String| {
        let lines = text.lines().filter(|line| !line.starts_with("set"));
        lines.collect::<Vec<_>>().join("\n") + "\n"
    };
    let with_switch = measured_lift(&Crane::new(same, same).analysed());
    let found = measured_lift(&Crane::new(without_switch, same).analysed());
    for (found_s, true_s) in found.into_iter().zip(with_switch) {
        assert!((found_s - true_s).abs() < 0.1, "{found:?} {with_switch:?}");
    }
}
