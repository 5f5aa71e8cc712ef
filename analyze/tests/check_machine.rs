//! `check-machine`: comparison with weighed loads.

use std::fs;

use serde_json::Value;
use tempfile::TempDir;

use super::support::{data, tipwatch};

/// Wheel loads of the simulation behind `tiny.mcap`, at rest on level ground (first row of
/// `tiny.truth.parquet`), used as weighed loads (N).
const SCALES_N: [(&str, f64); 4] = [
    ("FL", 13317.529),
    ("FR", 13292.521),
    ("RL", 3889.075),
    ("RR", 3864.542),
];

/// The tiny machine with `[weighed]` and its URDF changed.
fn machine(weighed: &str, urdf: impl Fn(String) -> String) -> (TempDir, String) {
    let folder = TempDir::new().unwrap();
    let read = |name: &str| fs::read_to_string(data(name)).unwrap();
    let path = folder.path().join("machine.toml");
    fs::write(&path, read("tiny.toml") + weighed).unwrap();
    fs::write(folder.path().join("tiny.urdf"), urdf(read("tiny.urdf"))).unwrap();
    let path = path.to_str().unwrap().to_owned();
    (folder, path)
}

fn checked(machine: &str, in_log: bool) -> Value {
    // the log is too short to show what the sensors are
    checked_with(machine, in_log, if in_log { 8 } else { 0 })
}

fn checked_with(machine: &str, in_log: bool, code: i32) -> Value {
    let log = data("tiny.mcap");
    let mut args = vec!["check-machine", machine, "--json"];
    if in_log {
        args.extend(["--log", log.to_str().unwrap()]);
    }
    let output = tipwatch(&args);
    let messages = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{messages}");
    serde_json::from_slice(&output.stdout).unwrap()
}

fn readings_in_newtons() -> String {
    let single: Vec<String> = SCALES_N.map(|(w, n)| format!("{w} = {n}")).to_vec();
    format!(
        "\n[weighed]\nunit = \"N\"\nwheels = {{ {} }}\n",
        single.join(", ")
    )
}

/// Axle, side and whole in kilograms.
fn sums_in_kilograms() -> String {
    let [fl, fr, rl, rr] = SCALES_N.map(|(_, n)| n / 9.8066);
    format!(
        "\n[weighed]\nunit = \"kg\"\nsigma = 5\nsums = [\n\
         {{ name = \"front axle\", wheels = [\"FL\", \"FR\"], load = {} }},\n\
         {{ name = \"left side\", wheels = [\"FL\", \"RL\"], load = {}, sigma = 7 }},\n\
         {{ wheels = [\"FL\", \"FR\", \"RL\", \"RR\"], load = {} }}]\n",
        fl + fr,
        fl + rl,
        fl + fr + rl + rr
    )
}

fn readings(check: &Value) -> &Vec<Value> {
    check["weighed"]["readings"].as_array().unwrap()
}

#[test]
fn val_static_loads_match_the_simulation() {
    for weighed in [readings_in_newtons(), sums_in_kilograms()] {
        let (_folder, machine) = machine(&weighed, |urdf| urdf);
        let check = checked(&machine, true);
        for reading in readings(&check) {
            let difference = reading["difference_n"].as_f64().unwrap();
            let mean_load = 34364.0 / 4.0;
            assert!(difference.abs() < 0.004 * mean_load, "{reading}");
            assert_eq!(reading["is_within"], true, "{reading}");
            // two percent of every mass and a centimetre of every centre of mass
            let sigma = reading["model_sigma_n"].as_f64().unwrap();
            assert!((100.0..600.0).contains(&sigma), "{reading}");
        }
    }
    let (_folder, machine) = machine(&sums_in_kilograms(), |urdf| urdf);
    let check = checked(&machine, true);
    let sigma = |i: usize| readings(&check)[i]["weighed_sigma_n"].as_f64().unwrap();
    assert!((sigma(0) - 5.0 * 9.8066).abs() < 1e-9);
    assert!((sigma(1) - 7.0 * 9.8066).abs() < 1e-9);
    assert_eq!(readings(&check)[2]["name"], "FL + FR + RL + RR");
}

/// Expected by hand: 2200 + 4 * 60 + 1062.9 kg.
#[test]
fn val_masses_and_geometry_match_the_urdf() {
    let (_folder, machine) = machine("", |urdf| urdf);
    let check = checked(&machine, false);
    assert!(check["weighed"].is_null());
    let mass = |part: usize| check["masses"][part]["mass_kg"].as_f64().unwrap();
    // the steering knuckles weigh a gram each
    assert!((mass(0) - 2200.002).abs() < 1e-9 && (mass(1) - 240.0).abs() < 1e-9);
    assert!((mass(4) - (mass(0) + mass(1) + mass(2))).abs() < 1e-9);
    assert!((check["wheelbase_m"].as_f64().unwrap() - 2.3).abs() < 1e-12);
    assert_eq!(check["axles"][0]["wheels"], serde_json::json!(["FL", "FR"]));
    let all = check["sums"].as_array().unwrap().last().unwrap();
    assert!((all["static_load_n"].as_f64().unwrap() - mass(4) * 9.8066).abs() < 1.0);
    assert_eq!(
        check["posture"]["source"],
        "the reference posture of the machine file"
    );
}

#[test]
fn a_wrong_model_is_beyond_two_sigma() {
    let heavier = |urdf: String| urdf.replace("<mass value='2200.0'/>", "<mass value='2600.0'/>");
    let (_folder, machine) = machine(&sums_in_kilograms(), heavier);
    let check = checked(&machine, true);
    let whole = &readings(&check)[2];
    assert_eq!(whole["is_within"], false, "{whole}");
    let difference = whole["difference_n"].as_f64().unwrap();
    assert!((difference - 400.0 * 9.8066).abs() < 20.0, "{whole}");
    let people = tipwatch(&["check-machine", &machine]);
    let text = String::from_utf8(people.stdout).unwrap();
    assert!(text.contains("BEYOND two sigma"), "{text}");
}

#[test]
fn a_stated_posture_needs_no_log() {
    let posture = "posture = { lift = -1.2943, tilt = -1.7279, extension = 0.2042 }\n";
    let (_folder, machine) = machine(&(readings_in_newtons() + posture), |urdf| urdf);
    let check = checked(&machine, false);
    assert_eq!(
        check["weighed"]["posture"]["source"],
        "posture of [weighed]"
    );
    for reading in readings(&check) {
        assert!(
            reading["difference_n"].as_f64().unwrap().abs() < 100.0,
            "{reading}"
        );
    }
}

#[test]
fn invalid_weighed_loads_are_rejected() {
    let refusal = |weighed: &str| {
        let (_folder, machine) =
            machine(&format!("\n[weighed]\nunit = \"kg\"\n{weighed}\n"), |u| u);
        let output = tipwatch(&["check-machine", &machine]);
        assert_eq!(output.status.code(), Some(1));
        String::from_utf8(output.stderr).unwrap()
    };
    for (weighed, parts) in [
        (
            "wheels = { XX = 1 }",
            ["weighed.wheels.XX", "names of [wheels]"],
        ),
        (
            "wheels = { FL = -1 }",
            ["weighed.wheels.FL", "not negative"],
        ),
        (
            "sums = [{ wheels = [], load = 1 }]",
            ["weighed.sums", "one wheel or more"],
        ),
        (
            "sums = [{ wheels = [\"FL\", \"FL\"], load = 1 }]",
            ["weighed.sums", "each once"],
        ),
        ("sigma = -2", ["weighed.sigma", "-2"]),
        ("posture = { boom = 1 }", ["weighed.posture.boom", "lift"]),
    ] {
        let messages = refusal(weighed);
        assert!(
            parts.iter().all(|part| messages.contains(part)),
            "{messages}"
        );
    }
}

#[test]
fn several_postures_are_compared_each_on_its_slope() {
    let [fl, fr, rl, rr] = SCALES_N.map(|(_, n)| n);
    let sums = |front: f64| {
        format!(
            "sums = [{{ name = \"front axle\", wheels = [\"FL\", \"FR\"], load = {front} }}, {{ wheels = [\"FL\", \"FR\", \"RL\", \"RR\"], load = {} }}]\n",
            fl + fr + rl + rr
        )
    };
    let posture = "posture = { lift = -1.294, tilt = -1.728, slew = 0.0, extension = 0.204 }\n";
    let weighed = format!(
        "\n[weighed]\nunit = \"N\"\nsigma = 50\n[[weighed.postures]]\nname = \"level\"\n{posture}{}\
         [[weighed.postures]]\nname = \"uphill\"\nslope = [0.1, 0.0]\n{posture}{}\
         [[weighed.postures]]\nname = \"anywhere\"\nslope_unknown = true\n{posture}{}",
        sums(fl + fr),
        sums(fl + fr),
        sums(fl + fr)
    );
    let (_folder, machine) = machine(&weighed, |urdf| urdf);
    // the loads of level ground contradict the machine nose up
    let check = checked_with(&machine, false, 8);
    assert!(check["weighed"].is_null());
    let weighings = check["weighings"].as_array().unwrap();
    let number = |weighing: usize, reading: usize, key: &str| {
        weighings[weighing]["readings"][reading][key]
            .as_f64()
            .unwrap()
    };
    // nose up, the front axle is lighter, and the scales show the weight along the normal
    assert!(
        number(1, 0, "model_n") < number(0, 0, "model_n") - 500.0,
        "{weighings:?}"
    );
    let share = number(1, 1, "model_n") / number(0, 1, "model_n");
    assert!((share - 0.1_f64.cos()).abs() < 1e-3, "{share}");
    // an unknown slope makes the model's load uncertain, not that of all wheels
    assert!(
        number(2, 0, "model_sigma_n") > 3.0 * number(0, 0, "model_sigma_n"),
        "{weighings:?}"
    );
    assert!(
        number(2, 1, "model_sigma_n") < 1.2 * number(0, 1, "model_sigma_n"),
        "{weighings:?}"
    );
}

#[test]
fn what_is_wrong_with_a_posture_is_said() {
    let said = |posture: &str| {
        let weighed = format!("\n[weighed]\nunit = \"N\"\n[[weighed.postures]]\n{posture}");
        let (_folder, machine) = machine(&weighed, |urdf| urdf);
        let output = tipwatch(&["check-machine", &machine]);
        assert_eq!(output.status.code(), Some(1));
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    for (posture, expected) in [
        (
            "posture = { lift = -1.0 }\n",
            "weighed.postures 1: expected wheels, sums or specific_force",
        ),
        ("wheels = { XX = 1.0 }\n", "weighed.postures 1.wheels.XX"),
        (
            "wheels = { FL = nan }\n",
            "expected a finite number, found nan",
        ),
        (
            "posture = { no = 1.0 }\nwheels = { FL = 1.0 }\n",
            "weighed.postures 1.posture.no",
        ),
        (
            "slope = [3.0, 0.0]\nwheels = { FL = 1.0 }\n",
            "weighed.postures 1.slope",
        ),
        (
            "slope = [0.1, 0.0]\nslope_unknown = true\nwheels = { FL = 1.0 }\n",
            "slope_unknown",
        ),
        (
            "specific_force = [0.0, 0.0, 1.0]\n",
            "about as long as gravity",
        ),
    ] {
        let message = said(posture);
        assert!(message.contains(expected), "{posture}: {message}");
    }
}

/// Axles and whole machine in kilograms, the latter off by so much; weighed to 5 kg.
fn axles_and_all(off_kg: f64) -> String {
    let [fl, fr, rl, rr] = SCALES_N.map(|(_, n)| n / 9.8066);
    format!(
        "\n[uncertainty]\nmass_share = 0.05\n[weighed]\nunit = \"kg\"\nsigma = 5\nposture = {{ lift = -1.3, tilt = -1.4 }}\nsums = [\n\
         {{ name = \"front axle\", wheels = [\"FL\", \"FR\"], load = {} }},\n\
         {{ name = \"rear axle\", wheels = [\"RL\", \"RR\"], load = {} }},\n\
         {{ name = \"all\", wheels = [\"FL\", \"FR\", \"RL\", \"RR\"], load = {} }}]\n",
        fl + fr,
        rl + rr,
        fl + fr + rl + rr + off_kg
    )
}

#[test]
fn weighings_that_contradict_each_other_are_no_result() {
    let (folder, machine) = machine(&axles_and_all(147.0), |u| u);
    let output = tipwatch(&["check-machine", &machine]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(4), "{text}");
    assert!(text.contains("CONTRADICT each other"), "{text}");
    let out = folder.path().join("identified.toml");
    let out = out.to_str().unwrap();
    let output = tipwatch(&["identify", "--machine", &machine, "--out", out]);
    let messages = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(4), "{messages}");
    assert!(
        messages.contains("weighings contradict each other"),
        "{messages}"
    );
    assert!(!fs::exists(out).unwrap());
    // if the scales are as bad as that, the user may say so
    let output = tipwatch(&[
        "identify",
        "--machine",
        &machine,
        "--out",
        out,
        "--widen-sigmas",
        "20",
    ]);
    let messages = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{messages}");
    let text = fs::read_to_string(out).unwrap();
    assert!(text.contains("sigma_factor = 20.0"), "{text}");
    let output = tipwatch(&["identify", "--machine", &machine, "--widen-sigmas", "0.5"]);
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn a_sum_of_two_weighed_axles_is_no_third_weighing() {
    let (_folder, machine) = machine(&axles_and_all(0.0), |u| u);
    let output = tipwatch(&["identify", "--machine", &machine, "--json"]);
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(0), "{found}");
    let note = found["notes"][0].as_str().unwrap();
    assert!(
        note.contains("scale under all") && note.contains("sum of other readings"),
        "{note}"
    );
    let fitted = found["fitted"].as_array().unwrap();
    assert!(
        fitted.iter().all(|row| row["sensor"] != "scale under all"),
        "{fitted:?}"
    );
    assert!(found["weighings"].is_null(), "{found}");
}

#[test]
fn a_weighing_on_supports_that_are_not_stated_is_rejected() {
    let (_folder, machine) = machine(
        "\n[weighed]\nunit = \"kg\"\nsupports = [\"FL\", \"FR\"]\nwheels = { FL = 1000 }\n",
        |u| u,
    );
    let output = tipwatch(&["check-machine", &machine]);
    let messages = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{messages}");
    assert!(messages.contains("weighed.supports"), "{messages}");
}

/// No position is beyond limits that are wider than a turn, or than the slide of a long boom.
#[test]
fn limits_that_find_no_wrong_position_are_told() {
    let wide = |urdf: fn(String) -> String| {
        let (_folder, machine) = machine("", urdf);
        let found = checked(&machine, false);
        let notes = found["notes"].as_array().unwrap();
        let notes = notes.iter().filter_map(Value::as_str);
        let found: Vec<String> = notes
            .filter(|note| note.contains("Limits in the URDF"))
            .map(str::to_owned)
            .collect();
        found
    };
    let [note] = &wide(|urdf| urdf)[..] else {
        panic!("expected one note");
    };
    for joint in ["slew", "lift", "tilt", "extension"] {
        assert!(note.contains(joint), "{note}");
    }
    // the rods of cylinders and the wheels have no encoder of their own
    assert!(!note.contains("rod") && !note.contains("wheel"), "{note}");
    let narrow = |urdf: String| {
        let narrow = urdf.replace("lower='-10' upper='10'", "lower='-3.1416' upper='3.1416'");
        let (before, extension) = narrow.split_once("<joint name='extension'").unwrap();
        let extension = extension.replacen("3.1416", "1", 2);
        format!("{before}<joint name='extension'{extension}")
    };
    assert_eq!(wide(narrow), [] as [String; 0]);
}

/// After a gap a joint may be anywhere that its greatest velocity leads.
#[test]
fn velocities_that_find_no_slip_are_told() {
    let told = |change: &dyn Fn(String) -> String| {
        let folder = TempDir::new().unwrap();
        let source = data("tiny");
        let path = folder.path().join("tiny.toml");
        fs::copy(source.with_extension("toml"), &path).unwrap();
        let urdf = fs::read_to_string(source.with_extension("urdf")).unwrap();
        fs::write(path.with_extension("urdf"), change(urdf)).unwrap();
        let found = checked(path.to_str().unwrap(), false);
        let notes = found["notes"].as_array().unwrap().iter();
        let notes = notes.filter_map(|note| note.as_str().map(str::to_owned));
        let mut notes = notes.filter(|note| note.starts_with("Greatest velocities"));
        notes.next()
    };
    let note = told(&|urdf| urdf).unwrap();
    // 20 rad/s for a quarter of a second are more than half a turn; 20 m/s are two metres
    assert!(
        note.contains("in 0.25 s of lift, tilt, slew, extension"),
        "{note}"
    );
    assert!(!note.contains("steer") && !note.contains("wheel"), "{note}");
    let at = |rate: &'static str| {
        move |urdf: String| urdf.replace("velocity='10'", &format!("velocity='{rate}'"))
    };
    let note = told(&at("2")).unwrap();
    assert!(note.contains("in 1 s of lift, tilt, slew, extension") && !note.contains("0.25"));
    // half a turn takes more than three seconds, two metres two
    assert_eq!(told(&at("0.5")), None);
}

/// The loads that the model has in the reference posture of the machine file, as weighed loads.
fn weighed_in_reference_posture() -> String {
    let (_folder, machine) = machine("", |urdf| urdf);
    let check = checked(&machine, false);
    let posture = check["posture"]["joints"].as_array().unwrap();
    let is_at_zero = |joint: &Value| joint["position"].as_f64() == Some(0.0);
    assert!(!posture.iter().all(is_at_zero), "{posture:?}");
    let wheels = check["wheels"].as_array().unwrap().iter();
    let loads = wheels.map(|wheel| {
        let load = wheel["static_load_n"].as_f64().unwrap();
        format!("{} = {load}", wheel["wheel"].as_str().unwrap())
    });
    let loads: Vec<String> = loads.collect();
    format!(
        "\n[weighed]\nunit = \"N\"\nsigma = 50.0\nwheels = {{ {} }}\n",
        loads.join(", ")
    )
}

#[test]
fn identify_reads_weighings_in_the_posture_of_check_machine() {
    let (_folder, machine) = machine(&weighed_in_reference_posture(), |urdf| urdf);
    let check = checked(&machine, false);
    for reading in readings(&check) {
        assert!(reading["sigmas"].as_f64().unwrap().abs() < 0.1, "{reading}");
    }
    let output = tipwatch(&["identify", "--machine", &machine]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned()
        + &String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{text}");
}

#[test]
fn a_weighing_that_contradicts_the_machine_is_not_decided() {
    let half = "\n[weighed]\nunit = \"N\"\nsigma = 50.0\nsums = [{ wheels = [\"FL\", \"FR\", \"RL\", \"RR\"], load = 17000.0 }]\n";
    let (_folder, machine) = machine(half, |urdf| urdf);
    let output = tipwatch(&["check-machine", &machine]);
    let text = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(8), "{text}");
    assert!(text.contains("BEYOND two sigma"), "{text}");
}
