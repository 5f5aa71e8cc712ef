//! `identify` on simulated logs: a machine file with wrong masses and centres of mass, load cells with the simulator's
//! contact forces.

use std::path::{Path, PathBuf};

use tempfile::TempDir;
use tipwatch_analyze::base::options::Estimator;
use tipwatch_analyze::setup::identify::{
    IdentificationDocument, Identified, Request, identify, machine_file_text, text,
};
use tipwatch_analyze::setup::validate::validate;
use tipwatch_binding::MachineFile;
use tipwatch_tests::data;

use crate::measured_loads::{cells, with_loads};

/// Uncertainty of a machine whose numbers come from a data sheet.
const SHEET: &str = "\n[uncertainty]\nmass_share = 0.05\ncom = 0.03\n";

/// The numbers between quotation marks after `before`.
fn after<'t>(text: &'t str, before: &str) -> (&'t str, &'t str, &'t str) {
    let (start, rest) = text.split_once(before).unwrap();
    let (value, rest) = rest.split_once('\'').unwrap();
    (start, value, rest)
}

/// A URDF whose masses are off by 5 % and whose centres of mass by 3 cm, up or down by turns.
fn wrong(urdf: &str) -> String {
    let mut text = String::new();
    for (k, part) in urdf.split("<inertial>").enumerate() {
        if k == 0 {
            text.push_str(part);
            continue;
        }
        let (start, xyz, rest) = after(part, "xyz='");
        let side = |j: usize| if (k * 7 + j * 3) % 5 < 2 { 1.0 } else { -1.0 };
        let moved: Vec<String> = xyz
            .split_whitespace()
            .enumerate()
            .map(|(j, value)| (value.parse::<f64>().unwrap() + 0.03 * side(j)).to_string())
            .collect();
        let (between, mass, rest) = after(rest, "value='");
        let mass = mass.parse::<f64>().unwrap() * (1.0 + 0.05 * side(3));
        text += &format!(
            "<inertial>{start}xyz='{}'{between}value='{mass}'{rest}",
            moved.join(" ")
        );
    }
    text
}

/// A folder with logs that have load cells, a machine file with the true machine and one with wrong parameters.
struct Case {
    folder: TempDir,
    logs: Vec<PathBuf>,
    truth: MachineFile,
    stated: MachineFile,
}

impl Case {
    fn new(logs: &[PathBuf]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let first = &logs[0];
        let urdf = std::fs::read_to_string(first.with_extension("urdf")).unwrap();
        let toml = std::fs::read_to_string(first.with_extension("toml")).unwrap();
        let own_urdf = first.with_extension("urdf");
        let own_urdf = own_urdf.file_name().unwrap().to_str().unwrap();
        let file = |name: &str, urdf: &str| {
            std::fs::write(folder.path().join(format!("{name}.urdf")), urdf).unwrap();
            let text =
                toml.replace(own_urdf, &format!("{name}.urdf")) + "\n" + &cells(60.0) + SHEET;
            let path = folder.path().join(format!("{name}.toml"));
            std::fs::write(&path, text).unwrap();
            MachineFile::read(&path).unwrap()
        };
        let (truth, stated) = (file("truth", &urdf), file("stated", &wrong(&urdf)));
        let logs = logs
            .iter()
            .map(|log| with_loads(folder.path(), log, |_, loads| loads));
        Self {
            logs: logs.collect(),
            truth,
            stated,
            folder,
        }
    }

    fn identify(&self, logs: &[PathBuf]) -> Identified {
        let request = Request {
            logs: logs.to_vec(),
            level: None,
            sigma_factor: None,
        };
        identify(&self.stated, &request).unwrap()
    }

    /// The identified machine file, written and read again.
    fn write(&self, found: &Identified) -> MachineFile {
        let text = machine_file_text(&self.stated, found, self.folder.path());
        let path = self.folder.path().join("identified.toml");
        std::fs::write(&path, text).unwrap();
        MachineFile::read(&path).unwrap()
    }

    /// Root mean square of measured minus computed loads of a log (N), and the share inside two standard deviations.
    fn error(&self, file: &MachineFile, log: &Path) -> (f64, f64) {
        let found = validate(file, &[log.to_path_buf()], Estimator::Smoother).unwrap();
        (found.rms_n.unwrap(), found.inside_sigma[1].unwrap())
    }
}

#[test]
fn val_a_log_that_was_held_back_is_predicted_as_by_the_true_machine() {
    let logs = ["tiny", "corner_brake", "hard_brake"].map(|name| data(&format!("{name}.mcap")));
    let case = Case::new(&logs);
    // the last log is not shown
    let found = case.identify(&case.logs[..2]);
    let identified = case.write(&found);
    let last = &case.logs[2];
    let [truth, stated, after] =
        [&case.truth, &case.stated, &identified].map(|file| case.error(file, last));
    eprintln!("truth {truth:?}, stated {stated:?}, identified {after:?}");
    assert!(stated.0 > 4.0 * truth.0, "{stated:?} {truth:?}");
    assert!(after.0 < 1.5 * truth.0, "{truth:?} {stated:?} {after:?}");
    // the band is narrower and still holds
    assert!(after.1 > 0.9, "{after:?}");
    let held = found.result.held_back.as_ref().unwrap();
    assert!(
        held.is_no_worse() && held.loads_after < 0.5 * held.loads_before,
        "{held:?}"
    );
}

#[test]
fn the_new_machine_file_keeps_the_old_one_and_its_comments() {
    let case = Case::new(&[data("corner_brake.mcap")]);
    let mut stated = case.stated.clone();
    stated.text.push_str("\n# a remark of mine\n");
    let found = identify(
        &stated,
        &Request {
            logs: case.logs.clone(),
            level: None,
            sigma_factor: None,
        },
    )
    .unwrap();
    let text = machine_file_text(&stated, &found, case.folder.path());
    let (kept, added) = text.split_once("# Written by tipwatch identify").unwrap();
    assert_eq!(kept.trim_end(), stated.text.trim_end());
    assert!(added.contains("[identified]") && added.contains("sha256"));
    // once more with the result: one table, not two
    let again = MachineFile::from_text(&stated.path, &text).unwrap();
    let second = machine_file_text(&again, &found, case.folder.path());
    assert_eq!(second.matches("[identified]").count(), 1, "{second}");
    // what it says is what was found, to the bit
    let machine = found.machine.clone();
    let read = again.spec.identified_of(&machine).unwrap().unwrap();
    assert_eq!(read, found.result.identified);
    // elsewhere the URDF is still found
    let elsewhere = tempfile::tempdir().unwrap();
    let text = machine_file_text(&stated, &found, elsewhere.path());
    let path = elsewhere.path().join("m.toml");
    std::fs::write(&path, text).unwrap();
    assert!(MachineFile::read(&path).unwrap().check_alone().is_ok());
}

#[test]
fn an_identification_of_another_machine_is_refused() {
    let case = Case::new(&[data("corner_brake.mcap")]);
    let found = case.identify(&case.logs);
    let identified = case.write(&found);
    let other = identified.text.replace("stated.urdf", "truth.urdf");
    let other = MachineFile::from_text(&identified.path, &other).unwrap();
    let message = other.check_alone().unwrap_err().to_string();
    assert!(
        message.contains("identified.nominal") && message.contains("run tipwatch identify again"),
        "{message}"
    );
    for (from, to, said) in [
        ("share = 0.9", "share = 1.9", "identified.direction.share"),
        (
            "\"base_link.mass\"",
            "\"base_linx.mass\"",
            "identified.parameters",
        ),
        ("\nsigma = [0.", "\nsigma = [7.", "identified.sigma"),
        ("\nchange = [", "\nchange = [1.0, ", "identified.change"),
    ] {
        assert!(identified.text.contains(from), "{from}");
        let text = identified.text.replacen(from, to, 1);
        let file = MachineFile::from_text(&identified.path, &text).unwrap();
        let message = file.check_alone().unwrap_err().to_string();
        assert!(message.contains(said), "{from}: {message}");
    }
}

#[test]
fn the_result_says_what_the_data_do_not_tell() {
    let case = Case::new(&[data("corner_brake.mcap")]);
    let found = case.identify(&case.logs);
    let text = text(&found);
    for part in [
        "worth",
        "not told at all",
        "not told apart",
        "held back",
        "each keeps its standard deviation from before",
        "largest correlations",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let document = serde_json::to_value(IdentificationDocument::of(&found)).unwrap();
    let effective = document["sources"][0]["independent_instants"]
        .as_f64()
        .unwrap();
    let instants = document["sources"][0]["instants"].as_f64().unwrap();
    assert!(effective < 0.25 * instants, "{effective} of {instants}");
    assert!(document["not_told"].as_array().unwrap().len() > 20);
}

#[test]
fn lifted_wheels_are_not_used() {
    let case = Case::new(&[data("swing_lift.mcap")]);
    let found = case.identify(&case.logs);
    assert!(found.result.estimates.iter().all(|e| e.change.is_finite()));
    let used: usize = found
        .result
        .sources
        .iter()
        .map(|source| source.instants)
        .sum();
    let all = validate(&case.stated, &case.logs, Estimator::Smoother).unwrap();
    assert!(used > 50 && all.logs[0].rows_with_lifted_wheel > 0);
}

#[test]
fn nothing_to_identify_from_is_an_error() {
    let file = MachineFile::read(&data("corner_brake.toml")).unwrap();
    let request = Request {
        logs: vec![data("corner_brake.mcap")],
        level: None,
        sigma_factor: None,
    };
    let message = format!("{:#}", identify(&file, &request).unwrap_err());
    assert!(message.contains("expected measured loads"), "{message}");
}

#[test]
fn val_a_cylinder_tells_the_mass_of_a_payload() {
    let toml = std::fs::read_to_string(data("lift_payload.toml")).unwrap();
    let force = "name = \"lift\"\nforce = { topic = \"/actuators\", joint = \"lift_rod\" }\n";
    let payload = "\n[[payload]]\nlink = \"tool\"\nmass = 200\nmass_sigma = 150\ncom = [0.405, -0.4313, -0.0134]\n";
    let text = toml.replacen("name = \"lift\"\n", force, 1) + payload;
    let file = MachineFile::from_text(&data("lift_payload.toml"), &text).unwrap();
    let request = Request {
        logs: vec![data("lift_payload.mcap")],
        level: None,
        sigma_factor: None,
    };
    let found = identify(&file, &request).unwrap();
    let payload = found
        .result
        .estimates
        .iter()
        .find(|e| e.name == "payload_1.mass")
        .unwrap();
    eprintln!("{payload:?}");
    let error = 200.0 + payload.change - 320.0;
    assert!(
        error.abs() < 2.5 * payload.sigma && error.abs() < 0.1 * 320.0,
        "{payload:?}"
    );
    assert!(payload.sigma < 0.4 * payload.prior_sigma, "{payload:?}");
}

#[test]
fn level_ground_tells_how_the_imu_leans() {
    let toml = std::fs::read_to_string(data("folded_arm.toml")).unwrap() + &cells(60.0);
    let folder = tempfile::tempdir().unwrap();
    let log = with_loads(folder.path(), &data("folded_arm.mcap"), |_, loads| loads);
    let file = MachineFile::from_text(&data("folded_arm.toml"), &toml).unwrap();
    let sigma = |level: Option<f64>| {
        let request = Request {
            logs: vec![log.clone()],
            level,
            sigma_factor: None,
        };
        let found = identify(&file, &request).unwrap();
        let lean = found
            .result
            .estimates
            .iter()
            .find(|e| e.name == "imu.rotation_y")
            .unwrap();
        (lean.change, lean.sigma, lean.prior_sigma)
    };
    let (without, with) = (sigma(None), sigma(Some(0.001)));
    assert!(with.1 < without.1, "{without:?} {with:?}");
}

mod needs_shared {
    use super::*;
    use tipwatch_tests::beside;

    #[test]
    #[ignore = "needs ../shared"]
    fn val_the_arm_on_a_standing_machine_corrects_it_for_driving() {
        for noisy in ["", "_clean"] {
            let logs =
                ["flat_arm", "drive_brake"].map(|name| beside(&format!("sim/{name}{noisy}.mcap")));
            let case = Case::new(&logs);
            let found = case.identify(&case.logs[..1]);
            eprintln!("{}", text(&found));
            let identified = case.write(&found);
            for log in &case.logs {
                let [truth, stated, after] =
                    [&case.truth, &case.stated, &identified].map(|file| case.error(file, log));
                eprintln!(
                    "{}: truth {truth:?}, stated {stated:?}, identified {after:?}",
                    log.display()
                );
            }
            let held = found.result.held_back.as_ref().unwrap();
            let truth = case.error(&case.truth, &case.logs[0]).0;
            assert!(held.loads_after < 1.5 * truth, "{held:?} {truth}");
        }
    }
}
