//! The program as a user runs it: replay and monitor as processes, node by shared memory only.

use std::path::{Path, PathBuf};
use std::time::Duration;

use tipwatch_analyze::analysis::Analysis;
use tipwatch_binding::MachineFile;
use tipwatch_live::replay::LogSamples;
use tipwatch_live::wire::topics::EVENT_ROW;
use tipwatch_mechanics::prediction::{Law, PredictedNumber, PredictionGap};
use tipwatch_mechanics::state::Reason;
use tipwatch_mechanics::{Contribution, Quantity};

use crate::arm_forces::with_forces;
use crate::payloads::{FORCE, PRESSURES, SCALE, with_payload};
use crate::support::offline::causal;
use crate::support::{Ended, World, data};

/// Returns the text of the value of a key in a line of JSON.
fn after<'a>(text: &'a str, key: &str) -> &'a str {
    let mark = format!("\"{key}\":");
    let start = text
        .find(&mark)
        .unwrap_or_else(|| panic!("no {key} in {text}"))
        + mark.len();
    let value = &text[start..];
    match value.as_bytes()[0] {
        b'{' => &value[..=value.find('}').unwrap()],
        b'[' => &value[..=value.find(']').unwrap()],
        _ => &value[..value.find([',', '}']).unwrap()],
    }
}

fn assert_same(json: &str, number: f64, place: &str) {
    if number.is_finite() {
        // the standard library's reading is exact; serde_json's is not by default
        assert_eq!(
            json.parse::<f64>().unwrap().to_bits(),
            number.to_bits(),
            "{place}"
        );
    } else {
        assert_eq!(json, "null", "{place}");
    }
}

fn assert_same_row(line: &str, analysis: &Analysis, row: usize) {
    let rows = &analysis.rows;
    let value: serde_json::Value = serde_json::from_str(line).unwrap();
    assert_eq!(value["schema"], 3);
    assert_eq!(value["time_ns"], rows.times_ns[row]);
    assert_eq!(value["valid"], rows.reasons[row].leave_valid());
    let reasons: Vec<&str> = rows.reasons[row].iter().map(Reason::name).collect();
    assert_eq!(value["reasons"], serde_json::json!(reasons));
    let verdicts = rows.whole().verdicts.as_ref().unwrap();
    let verdict = verdicts.verdicts[row];
    assert_eq!(value["verdict"], verdict.level.name());
    assert_eq!(value["verdict_latched"], verdict.latched_level.name());
    assert_eq!(value["basis"], verdict.basis.name());
    let unproven = verdict.unproven.names(&analysis.machine);
    assert_eq!(value["unproven"], serde_json::json!(unproven));
    let joints = analysis.machine.joints();
    let name = |joint: usize| joints[joint].name.clone();
    let ways = verdict.unproven.iter(joints.len());
    let ways: Vec<String> = ways.map(|proof| proof.way(name)).collect();
    assert_eq!(value["proven_by"], serde_json::json!(ways));
    let standing = analysis.rows.machine_at(row).map(|on| {
        let names = on.wheels().iter().map(|wheel| wheel.name.to_lowercase());
        names.collect::<Vec<_>>()
    });
    assert_eq!(value["standing"], serde_json::json!(standing));
    let lacks_reference = value["ground_gap"] == "no_reference_loads";
    assert_eq!(
        value["ground_gap"].is_null() || lacks_reference,
        standing.is_some()
    );
    assert!(!lacks_reference || value["utilisation"].is_null());
    let time_to_lift_off_s = verdicts.time_to_lift_off_s[row];
    let number = |quantity| rows.whole().outcomes.column(quantity)[row];
    type OfWheel = fn(usize) -> Quantity;
    let by_wheel: [(&str, OfWheel); 5] = [
        ("load_n", Quantity::Load),
        ("otf_n", Quantity::Otf),
        ("load_sigma_n", Quantity::LoadSigma),
        ("load_min_n", Quantity::LoadLeast),
        ("load_max_n", Quantity::LoadLargest),
    ];
    for (key, quantity) in by_wheel {
        for (index, wheel) in analysis.machine.wheels().iter().enumerate() {
            let json = after(after(line, key), &wheel.name.to_lowercase());
            let place = format!("{key} of {} in row {row}", wheel.name);
            assert_same(json, number(quantity(index)), &place);
        }
    }
    assert_same(
        after(line, "time_to_lift_off_s"),
        time_to_lift_off_s,
        "time_to_lift_off_s",
    );
    assert_same_prediction(&value, analysis, row);
    let single = [
        ("utilisation", Quantity::Utilisation),
        ("zmp_x_m", Quantity::ZmpX),
        ("zmp_y_m", Quantity::ZmpY),
        ("zmp_margin_m", Quantity::ZmpMargin),
        ("normal_force_n", Quantity::NormalForce),
    ];
    for (key, quantity) in single {
        assert_same(after(line, key), number(quantity), key);
    }
}

/// Asserts that the predictions by every assumed motion have the same bits.
fn assert_same_prediction(value: &serde_json::Value, analysis: &Analysis, row: usize) {
    let verdicts = analysis.rows.whole().verdicts.as_ref().unwrap();
    let predictions = verdicts.predictions.as_ref().unwrap();
    let same = |json: &serde_json::Value, number: f64, place: &str| {
        // serde_json reads exactly here: the workspace asks for `float_roundtrip`
        let read = json.as_f64().unwrap_or(f64::NAN);
        let is_same = read.to_bits() == number.to_bits() || (json.is_null() && number.is_nan());
        assert!(is_same, "{place} of row {row}: {json} {number}");
    };
    same(
        &value["predicted"]["age_s"],
        predictions.age_s[row],
        "age_s",
    );
    for law in Law::ALL {
        let (json, columns) = (&value["predicted"][law.name()], predictions.of(law));
        let gap = columns.gaps[row].map(PredictionGap::name);
        assert_eq!(json["gap"].as_str(), gap, "row {row}");
        let wheels = analysis.machine.wheels();
        let wheel = columns.wheels[row].map(|wheel| wheels[wheel].name.to_lowercase());
        assert_eq!(json["wheel"].as_str(), wheel.as_deref());
        let cause = columns.causes[row].map(Contribution::name);
        assert_eq!(json["cause"].as_str(), cause);
        for (key, number) in [
            ("lift_off_s", PredictedNumber::LiftOff),
            ("earliest_s", PredictedNumber::Earliest),
            ("latest_s", PredictedNumber::Latest),
            ("utilisation", PredictedNumber::Utilisation),
        ] {
            same(&json[key], columns.number(number)[row], key);
        }
        for (wheel, otf) in wheels.iter().zip(&columns.otf_least) {
            let json = &json["otf_min_n"][wheel.name.to_lowercase()];
            same(json, otf[row], "otf_min_n");
        }
    }
}

fn assert_all_rows(monitor: &Ended, name: &str) {
    let (log, machine) = (data(&format!("{name}.mcap")), data(&format!("{name}.toml")));
    assert_rows_of(monitor, &causal(&log, &machine));
}

/// Every row of a monitor is that of `tipwatch analyze --estimator causal` of the same log.
fn assert_rows_of(monitor: &Ended, analysis: &Analysis) {
    assert!(monitor.status.success(), "{}", monitor.err);
    let rows = |line: &&str| line.contains("\"event\":\"row\"");
    let lines: Vec<&str> = monitor.out.lines().filter(rows).collect();
    assert!(
        analysis
            .rows
            .reasons
            .iter()
            .any(|reasons| reasons.is_empty())
    );
    assert_eq!(lines.len(), analysis.rows.len(), "{}", monitor.err);
    for (row, line) in lines.iter().enumerate() {
        assert_same_row(line, analysis, row);
    }
    assert!(
        monitor
            .err
            .contains("0 lost, 0 refused, 0 repeated, 0 sent before joining"),
        "{}",
        monitor.err
    );
    let untested = (analysis.notes.iter()).find(|note| note.starts_with("Not tested by"));
    let untested = untested.map(|note| note.replace("this log", "this session"));
    assert_eq!(told_untested(&monitor.err), untested.as_deref());
}

/// Returns the monitor's statement on what the motion of its session has not tested.
fn told_untested(err: &str) -> Option<&str> {
    let mut told = (err.lines()).filter_map(|line| line.strip_prefix("monitor: "));
    told.find(|line| line.starts_with("Not tested by"))
}

// requirement: TW-VERDICT-24
#[test]
fn live_rows_equal_offline_rows_bit_for_bit() {
    let world = World::new("bits");
    let monitor = world.monitor(&data("tiny.toml"), &["--json", "--allow-untimed"]);
    let replay = world
        .replay("tiny", &["--speed", "max", "--lossless", "--wait", "60"])
        .end();
    assert!(replay.status.success(), "{}", replay.err);
    assert_all_rows(&monitor.end(), "tiny");
}

// requirement: TW-VERDICT-24
#[test]
fn live_verdicts_equal_offline_verdicts() {
    let world = World::new("lift");
    let monitor = world.monitor(
        &data("tiny_lift.toml"),
        &["--json", "--allow-untimed", "--wake", "poll"],
    );
    let replay = world.replay(
        "tiny_lift",
        &["--speed", "max", "--lossless", "--wait", "60"],
    );
    assert!(replay.end().status.success());
    let monitor = monitor.end();
    assert_all_rows(&monitor, "tiny_lift");
    let predicts = |law: &str| {
        let lines = monitor.out.lines().map(serde_json::from_str);
        let values = lines.map(Result::<serde_json::Value, _>::unwrap);
        let lifts = |value: serde_json::Value| value["predicted"][law]["lift_off_s"].is_number();
        values.filter(|value| value["event"] == "row").any(lifts)
    };
    assert!(predicts("go_on") && predicts("stop_arm"));
    for level in ["unknown", "assumed", "danger"] {
        let key = format!("\"verdict\":\"{level}\"");
        assert!(monitor.out.contains(&key), "{level}");
    }
}

/// Replays a log to a monitor, losing nothing; the rows are those of the analysis. Returns them as JSON.
fn rows_on_supports(test: &str, log: &Path, machine: &Path) -> Vec<serde_json::Value> {
    let world = World::new(test);
    let monitor = world.monitor(machine, &["--json", "--allow-untimed"]);
    let options = ["--speed", "max", "--lossless", "--wait", "60"];
    let replay = world.replay_log(log, machine, &options).end();
    assert!(replay.status.success(), "{}", replay.err);
    let monitor = monitor.end();
    assert_rows_of(&monitor, &causal(log, machine));
    let rows = (monitor.out.lines()).map(|line| serde_json::from_str(line).unwrap());
    rows.filter(|row: &serde_json::Value| row["event"] == "row")
        .collect()
}

// requirement: TW-VERDICT-14, TW-VERDICT-24
#[test]
fn live_rows_of_a_crane_on_its_outriggers_equal_offline_rows() {
    let rows = rows_on_supports("crane", &data("crane.mcap"), &data("crane.toml"));
    let feet = serde_json::json!(["ofl", "ofr", "orl", "orr"]);
    let wheels = serde_json::json!(["fl", "fr", "rl", "rr"]);
    let on = |set: &serde_json::Value| rows.iter().filter(|row| row["standing"] == *set).count();
    assert!(
        on(&feet) > 900 && on(&wheels) > 600,
        "{} {}",
        on(&feet),
        on(&wheels)
    );
    // what is off the ground has no number, and what is on it has one
    for row in rows.iter().filter(|row| row["valid"] == true) {
        for (set, other) in [(&feet, &wheels), (&wheels, &feet)] {
            if row["standing"] == *set {
                let load = |name: &serde_json::Value| &row["load_n"][name.as_str().unwrap()];
                assert!(
                    set.as_array()
                        .unwrap()
                        .iter()
                        .all(|it| load(it).is_number())
                );
                assert!(
                    other
                        .as_array()
                        .unwrap()
                        .iter()
                        .all(|it| load(it).is_null())
                );
            }
        }
    }
    // while it jacks, nothing is known, and there is no alarm
    let gaps = |gap: &str| rows.iter().filter(|row| row["ground_gap"] == gap).count();
    assert!(gaps("transition") > 0 && gaps("impossible") == 0);
    for row in &rows {
        if row["standing"].is_null() {
            assert_eq!(row["verdict"], "unknown", "{row}");
            assert!(row["utilisation"].is_null());
        }
    }
    // the ground under one foot sinks until it carries nothing: the only alarm, and by that foot
    let is_danger = |row: &&serde_json::Value| row["verdict"] == "danger";
    let alarms: Vec<_> = rows.iter().filter(is_danger).collect();
    assert!(!alarms.is_empty());
    assert!(alarms.iter().all(|row| row["standing"] == feet));
}

/// `tiny.toml` with wheel RR raised while a number of the log is above a threshold.
fn with_raised_wheel(folder: &Path) -> PathBuf {
    let text = std::fs::read_to_string(data("tiny.toml")).unwrap();
    let raised = "link = \"wheel_rr\"\nradius = 0.35\nraised = { topic = \"/joint_states\", field = \"position\", \
                  joint = \"slew\", above = 0.1 }\n";
    let text = text
        .replace("link = \"wheel_rr\"\nradius = 0.35\n", raised)
        .replace("[contact]\n", "[contact]\ntransition = 0.2\n");
    std::fs::copy(data("tiny.urdf"), folder.join("tiny.urdf")).unwrap();
    let path = folder.join("raised.toml");
    std::fs::write(&path, text).unwrap();
    path
}

// requirement: TW-VERDICT-24
#[test]
fn live_rows_of_a_machine_with_a_raised_wheel_equal_offline_rows() {
    let folder = tempfile::tempdir().unwrap();
    let machine = with_raised_wheel(folder.path());
    let rows = rows_on_supports("raised", &data("tiny.mcap"), &machine);
    let on = |set: serde_json::Value| rows.iter().filter(|row| row["standing"] == set).count();
    let four = on(serde_json::json!(["fl", "fr", "rl", "rr"]));
    let three = on(serde_json::json!(["fl", "fr", "rl"]));
    assert!(four > 20 && three > 20, "{four} {three}");
    assert!(four + three < rows.len(), "a transition");
}

/// Load cells of the crane's outriggers, which show this share of what its jacks measure.
fn with_load_cells(folder: &Path, scales: [f64; 4]) -> PathBuf {
    let mut text = std::fs::read_to_string(data("crane.toml")).unwrap();
    for (index, (name, scale)) in ["OFL", "OFR", "ORL", "ORR"].iter().zip(scales).enumerate() {
        text += &format!(
            "[signals.wheels.{name}]\nload = {{ topic = \"/outriggers/force\", field = \"data[{index}]\", scale = {scale:.2} }}\n\
             sigma = 300.0\n"
        );
    }
    std::fs::copy(data("crane.urdf"), folder.join("crane.urdf")).unwrap();
    let path = folder.join("cells.toml");
    std::fs::write(&path, text).unwrap();
    path
}

fn is_on_outriggers(row: &serde_json::Value) -> bool {
    row["standing"] == serde_json::json!(["ofl", "ofr", "orl", "orr"])
}

// requirement: TW-VERDICT-24
#[test]
fn good_load_cells_cast_no_doubt_and_live_rows_equal_offline_rows() {
    let folder = tempfile::tempdir().unwrap();
    let machine = with_load_cells(folder.path(), [1.0; 4]);
    let rows = rows_on_supports("cells", &data("crane.mcap"), &machine);
    assert!(rows.iter().filter(|row| is_on_outriggers(row)).count() > 900);
    for row in &rows {
        assert_eq!(row["doubted_loads"], serde_json::json!([]), "{row}");
        assert!(row["unstated_mass_kg"].is_null());
    }
}

// requirement: TW-VERDICT-24, TW-VERDICT-26
#[test]
fn load_cells_that_contradict_the_weight_cast_doubt_live_as_offline() {
    let folder = tempfile::tempdir().unwrap();
    let machine = with_load_cells(folder.path(), [1.5; 4]);
    let rows = rows_on_supports("heavy", &data("crane.mcap"), &machine);
    let names = |row: &serde_json::Value| row["doubted_loads"].as_array().unwrap().clone();
    let is_doubted = |row: &&serde_json::Value| !names(row).is_empty();
    let doubted: Vec<_> = rows.iter().filter(is_doubted).collect();
    assert!(doubted.len() > 500, "{}", doubted.len());
    for row in &doubted {
        assert!(
            !matches!(row["verdict"].as_str(), Some("safe" | "assumed" | "notice")),
            "{row}"
        );
        assert_eq!(row["basis"], "doubted");
    }
    // both the sensor that is furthest off and the total, which a load that nobody stated would explain
    let named = |name: &str| doubted.iter().any(|row| names(row).contains(&name.into()));
    assert!(named("total") && ["ofl", "ofr", "orl", "orr"].iter().any(|name| named(name)));
    let explained = |row: &&&serde_json::Value| row["unstated_mass_kg"].as_f64() > Some(0.0);
    assert!(doubted.iter().filter(explained).count() > 300);
    // it begins two seconds after the machine came to stand on its outriggers
    let first = rows.iter().find(|row| is_on_outriggers(row)).unwrap();
    let since_ns = doubted[0]["time_ns"].as_i64().unwrap() - first["time_ns"].as_i64().unwrap();
    assert!(
        (2_000_000_000..3_000_000_000).contains(&since_ns),
        "{since_ns}"
    );
}

// requirement: TW-VERDICT-24
#[test]
fn joints_are_predicted_by_what_is_asked_of_them_live_as_offline() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(data("tiny_lift.urdf"), folder.path().join("tiny_lift.urdf")).unwrap();
    let text = std::fs::read_to_string(data("tiny_lift.toml")).unwrap();
    // the slewing joint is asked to turn, whatever it does
    let text = text
        + "[signals.joints.slew]\ncommand = { topic = \"/joint_states\", field = \"velocity\", joint = \"slew\", \
           offset = 0.3 }\n";
    let machine = folder.path().join("asked.toml");
    std::fs::write(&machine, text).unwrap();
    let asked = rows_on_supports("asked", &data("tiny_lift.mcap"), &machine);
    let as_it_moves = causal(&data("tiny_lift.mcap"), &data("tiny_lift.toml"));
    let verdicts = as_it_moves.rows.whole().verdicts.as_ref().unwrap();
    let predictions = verdicts.predictions.as_ref().unwrap();
    let (mut others, mut same) = (0, 0);
    // the first row comes before the first command
    for (row, line) in asked.iter().enumerate().skip(1) {
        assert_eq!(line["commanded"], serde_json::json!(["slew"]), "row {row}");
        let told = |law: Law| {
            let utilisation = &line["predicted"][law.name()]["utilisation"];
            let of_rows = predictions.of(law).number(PredictedNumber::Utilisation)[row];
            let of_rows = Some(of_rows).filter(|it| it.is_finite());
            (utilisation.as_f64(), of_rows)
        };
        let (goes_on, would_go_on) = told(Law::GoOn);
        others += usize::from(goes_on != would_go_on);
        // an arm that stops does not do what is asked
        if line["predicted"]["age_s"] == 0.0 && predictions.age_s[row] == 0.0 {
            let (stops, would_stop) = told(Law::StopArm);
            assert_eq!(stops, would_stop, "row {row}");
            same += usize::from(stops.is_some());
        }
    }
    assert!(same > 50, "{same}");
    assert!(others > 100, "{others}");
}

// requirement: TW-VERDICT-24
#[test]
fn payloads_that_are_stated_by_a_signal_or_weighed_have_the_bits_of_offline_rows() {
    let folder = tempfile::tempdir().unwrap();
    for (test, force, mass) in [
        ("scale", "", SCALE),
        ("force", FORCE, "\"estimate\""),
        ("pressures", PRESSURES, "\"estimate\""),
    ] {
        let machine = with_payload(folder.path(), force, mass);
        let rows = rows_on_supports(test, &data("lift_payload.mcap"), &machine);
        let known = rows.iter().filter(|row| row["payload_mass_kg"].is_number());
        let loads = known.filter(|row| row["load_n"]["fl"].is_number()).count();
        assert!(loads > 300, "{test}: {loads}");
        assert!(rows[0]["payload_mass_kg"].is_null() && rows[0]["verdict"] == "unknown");
    }
}

// requirement: TW-VERDICT-24, TW-VERDICT-26
#[test]
fn forces_of_the_arm_cast_doubt_live_as_offline() {
    let folder = tempfile::tempdir().unwrap();
    for (test, tilt, doubted) in [
        ("arm_forces", "", None),
        ("arm_forces_off", ", scale = 2.0", Some("tilt")),
    ] {
        let machine = with_forces(folder.path(), tilt);
        let rows = rows_on_supports(test, &data("lift_payload.mcap"), &machine);
        let wanted = serde_json::json!(doubted.iter().collect::<Vec<_>>());
        assert_eq!(rows.last().unwrap()["doubted_forces"], wanted);
        // without a doubt in the beginning
        assert_eq!(rows[100]["doubted_forces"], serde_json::json!([]));
    }
}

#[test]
fn replay_may_start_before_the_monitor() {
    let world = World::new("first");
    let replay = world.replay("tiny", &["--speed", "max", "--lossless", "--wait", "60"]);
    world.wait_for_producer();
    let monitor = world.monitor(&data("tiny.toml"), &["--json", "--allow-untimed"]);
    assert_all_rows(&monitor.end(), "tiny");
    assert!(replay.end().status.success());
}

#[cfg(target_os = "linux")]
#[test]
fn lossless_replay_waits_for_a_stopped_reader() {
    let world = World::new("held");
    let monitor = world.monitor(&data("tiny.toml"), &["--json", "--allow-untimed"]);
    world.wait_for_verdict(|_| true);
    monitor.signal("-STOP");
    let mut replay = world.replay("tiny", &["--speed", "max", "--lossless", "--wait", "60"]);
    world.wait_for_producer();
    // a replay that does not wait takes a fraction of this
    std::thread::sleep(Duration::from_millis(300));
    assert!(replay.child.try_wait().unwrap().is_none());
    monitor.signal("-CONT");
    assert_all_rows(&monitor.end(), "tiny");
    assert!(replay.end().status.success());
}

// requirement: TW-REFUSAL-02
#[test]
fn monitor_of_another_machine_refuses_to_run() {
    let folder = tempfile::tempdir().unwrap();
    let machine = folder.path().join("tiny.toml");
    let text = std::fs::read_to_string(data("tiny.toml")).unwrap();
    std::fs::write(
        &machine,
        text.replace(
            "roll_moment_distribution = 0.5",
            "roll_moment_distribution = 0.4",
        ),
    )
    .unwrap();
    std::fs::copy(data("tiny.urdf"), folder.path().join("tiny.urdf")).unwrap();

    let world = World::new("other");
    let monitor = world.monitor(&machine, &["--json"]);
    let replay = world.replay("tiny", &["--speed", "max", "--lossless", "--wait", "60"]);
    let monitor = monitor.end();
    assert_eq!(monitor.status.code(), Some(1));
    assert!(
        monitor
            .err
            .contains("expected the machine of the session, hash"),
        "{}",
        monitor.err
    );
    assert!(!monitor.out.contains("\"event\":\"row\""));
    // the replay has either lost its reader or sent everything before
    replay.end();
}

#[test]
fn lossless_replay_without_reader_fails() {
    let replay = World::new("alone")
        .replay("tiny", &["--speed", "max", "--lossless", "--wait", "0.1"])
        .end();
    assert_eq!(replay.status.code(), Some(1));
    assert!(
        replay.err.contains("expected a reader within 0.1 s"),
        "{}",
        replay.err
    );
}

#[test]
fn lossy_replay_without_reader_succeeds() {
    let replay = World::new("lossy")
        .replay("tiny", &["--speed", "max"])
        .end();
    assert!(replay.status.success(), "{}", replay.err);
}

#[test]
fn lossless_replay_fails_if_its_reader_dies() {
    let world = World::new("reader");
    let mut monitor = world.monitor(&data("tiny.toml"), &["--json", "--allow-untimed"]);
    let replay = world.replay("tiny", &["--speed", "0.1", "--lossless", "--wait", "60"]);
    world.wait_for_verdict(|verdict| verdict.event == EVENT_ROW);
    monitor.child.kill().unwrap();
    drop(monitor);
    let replay = replay.end();
    assert_eq!(replay.status.code(), Some(1), "{}", replay.err);
    assert!(
        replay.err.contains("the reader has disappeared after"),
        "{}",
        replay.err
    );
}

// requirement: TW-REFUSAL-02
#[test]
fn session_with_another_hash_is_rejected() {
    let file = MachineFile::read(&data("tiny.toml")).unwrap();
    let urdf = file.urdf(None, None).unwrap();
    let mut session = LogSamples::read(&data("tiny.mcap"), &file, None)
        .unwrap()
        .session;
    assert!(session.machine(&file, &urdf).is_ok());
    session.machine_hash ^= 1;
    let error = session.machine(&file, &urdf).unwrap_err().to_string();
    assert!(
        error.contains("expected the machine of the session"),
        "{error}"
    );
}
