//! The suspension optimiser over standard input and output, see [`tipwatch_suspension::protocol`].

use std::io::{BufRead, Read, Write};

use anyhow::{Context, Result, anyhow, bail};
use serde::Serialize;
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::machine::{ControlMode, LogFacts, Machine};
use tipwatch_suspension::protocol::{LineControl, Opening};

/// Far above any line of the protocol.
const LINE_LIMIT_BYTES: u64 = 1 << 20;

/// Serves one client until it closes its input. `mode` and `step_s` override the machine file.
///
/// # Errors
/// The machine has no controllable suspension, the first line does not name its joints, or reading or
/// writing fails.
pub fn serve(
    file: &MachineFile,
    mode: Option<ControlMode>,
    step_s: Option<f64>,
    mut input: impl BufRead,
    mut output: impl Write,
) -> Result<()> {
    let first = next_line(&mut input)?
        .ok_or_else(|| anyhow!("expected a first line with the joints, found none"))?;
    let opening = Opening::parse(&first)?;
    let machine = machine(file, &opening)?;
    let suspension = machine
        .suspension()
        .ok_or_else(|| anyhow!("{}: expected [suspension], found none", file.path.display()))?;
    let mut control = suspension.control.clone();
    control.mode = mode.unwrap_or(control.mode);
    control.rate = step_s.map_or(control.rate, |step| 1.0 / step);
    let (mut line_control, ready) = LineControl::new(&machine, &opening, &control)?;
    write_line(&mut output, &ready)?;
    while let Some(line) = next_line(&mut input)? {
        if !line.trim().is_empty() {
            write_line(&mut output, &line_control.answer(&line))?;
        }
    }
    Ok(())
}

/// The next line; `None` at the end of the input.
fn next_line(input: &mut impl BufRead) -> Result<Option<String>> {
    let mut bytes = Vec::new();
    let read = input.take(LINE_LIMIT_BYTES).read_until(b'\n', &mut bytes);
    match read.context("standard input: cannot be read")? as u64 {
        0 => return Ok(None),
        LINE_LIMIT_BYTES if !bytes.ends_with(b"\n") => {
            bail!("standard input: expected lines of less than {LINE_LIMIT_BYTES} bytes")
        }
        _ => {}
    }
    let line = String::from_utf8(bytes).context("standard input: expected UTF-8")?;
    let line = line.strip_suffix('\n').unwrap_or(&line);
    Ok(Some(line.strip_suffix('\r').unwrap_or(line).to_owned()))
}

fn machine(file: &MachineFile, opening: &Opening) -> Result<Machine> {
    let urdf = file.urdf(None, None)?;
    let names = opening.joint_names();
    let facts = LogFacts {
        joint_names: Some(&names),
        ..LogFacts::default()
    };
    let machine = file.spec.check(&urdf.text, &urdf.name, facts)?;
    if let Some(which) = machine.supports().not_constant() {
        bail!(
            "{}: {which}: expected supports that are always on the ground, found one that comes and goes or whose load is measured",
            file.spec.file
        );
    }
    Ok(machine)
}

fn write_line(output: &mut impl Write, value: &impl Serialize) -> Result<()> {
    let mut text = serde_json::to_string(value)?;
    text.push('\n');
    output
        .write_all(text.as_bytes())
        .and_then(|()| output.flush())
        .context("standard output: cannot be written")
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

    use std::collections::BTreeMap;
    use std::path::Path;

    use super::*;

    const DATA: &str = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../tests/data/second_paper.toml"
    );
    const JOINTS: [(&str, f64); 10] = [
        ("slew", 0.0),
        ("lift", -1.5),
        ("tilt", -1.5),
        ("extension", 0.3),
        ("suspension_right", -0.1),
        ("suspension_left", -0.1),
        ("wheel_fl", 0.0),
        ("wheel_fr", 0.0),
        ("wheel_rl", 0.0),
        ("wheel_rr", 0.0),
    ];

    fn talk(lines: &[String]) -> Result<Vec<serde_json::Value>> {
        let file = MachineFile::read(Path::new(DATA)).unwrap();
        let mut output = Vec::new();
        serve(&file, None, None, lines.join("\n").as_bytes(), &mut output)?;
        let text = String::from_utf8(output).unwrap();
        Ok(text
            .lines()
            .map(|line| serde_json::from_str(line).unwrap())
            .collect())
    }

    fn first() -> String {
        let joints: BTreeMap<_, _> = JOINTS.into_iter().collect();
        serde_json::json!({ "joints": joints }).to_string()
    }

    fn request(rods: [Option<f64>; 2], up: f64) -> String {
        let joints: BTreeMap<_, _> = JOINTS.map(|(name, at)| (name, [at, 0.0, 0.0])).into();
        serde_json::json!({ "joints": joints, "rods": rods, "specific_force": [0.0, 0.0, up], "angular_velocity": [0, 0, 0],
            "angular_acceleration": [0, 0, 0], "up": [0, 0, 1] })
        .to_string()
    }

    #[test]
    fn states_get_commands_and_invalid_lines_get_errors() {
        let rods = [Some(-0.1), Some(-0.1)];
        let answers = talk(&[
            first(),
            request(rods, 9.8066),
            "{\"joints\": 1}".into(),
            request([None, Some(-0.1)], 9.8066),
            request(rods, f64::NAN),
        ])
        .unwrap();
        assert_eq!(answers[0]["rods"][0], "suspension_right");
        let status = answers[1]["status"].as_str().unwrap();
        assert!(["optimal", "restrained"].contains(&status), "{status}");
        // the arm is in front: the platform moves backwards
        assert!(answers[1]["acceleration"][0].as_f64().unwrap().abs() > 0.001);
        assert!(answers[2]["error"].is_string());
        assert_eq!(answers[2]["hold"], true);
        assert_eq!(answers[3]["status"], "position_unknown");
        assert_eq!(answers[3]["hold"], true);
        assert_eq!(answers[4]["status"], "no_solution");
        assert_eq!(answers[4]["hold"], true);
        assert_eq!(answers.len(), 5);
    }

    #[test]
    fn an_endless_line_is_refused() {
        let file = MachineFile::read(Path::new(DATA)).unwrap();
        let endless = std::io::BufReader::new(std::io::repeat(b'x'));
        let refused = serve(&file, None, None, endless, Vec::new());
        assert!(refused.unwrap_err().to_string().contains("1048576 bytes"));
    }

    #[test]
    fn implausible_states_are_answered_by_hold_with_the_reason() {
        let rods = [Some(-0.1), Some(-0.1)];
        let good = request(rods, 9.8066);
        let edited = |from: &str, to: &str| {
            assert!(good.contains(from), "{from}");
            good.replace(from, to)
        };
        let cases = [
            (request([Some(0.4), Some(-0.1)], 9.8066), "outside_stroke"),
            (request([Some(-0.1), None], 9.8066), "row_invalid"),
            // the rod's joint says otherwise
            (request([Some(-0.13), Some(-0.1)], 9.8066), "input"),
            (request(rods, 500.0), "input"),
            (edited("\"up\":[0,0,1]", "\"up\":[0,0,2]"), "input"),
            (edited("\"up\":[0,0,1]", "\"up\":[0,0,null]"), "input"),
            (
                edited(
                    "\"angular_velocity\":[0,0,0]",
                    "\"angular_velocity\":[0,90,0]",
                ),
                "input",
            ),
            (
                edited(
                    "\"extension\":[0.3,0.0,0.0]",
                    "\"extension\":[30.0,0.0,0.0]",
                ),
                "input",
            ),
        ];
        for (line, reason) in cases {
            let answers = talk(&[first(), good.clone(), line.clone(), good.clone()]).unwrap();
            assert_eq!(answers[1]["hold"], false, "{}", answers[1]);
            assert_eq!(answers[1]["reasons"].as_array().unwrap().len(), 0);
            let held = &answers[2];
            assert_eq!(held["hold"], true, "{line}: {held}");
            let reasons = held["reasons"].as_array().unwrap();
            assert!(reasons.iter().any(|r| r == reason), "{line}: {held}");
            assert_eq!(held["velocity"][0], 0.0);
        }
    }

    #[test]
    fn a_machine_without_suspension_is_rejected() {
        let file = MachineFile::read(Path::new(DATA)).unwrap();
        let refused = serve(
            &file,
            Some(ControlMode::OneStep),
            None,
            first().as_bytes(),
            Vec::new(),
        );
        assert!(format!("{:#}", refused.unwrap_err()).contains("1.5 times"));
        let unnamed = talk(&["{\"joints\": {}}".into()]);
        assert!(unnamed.is_err());
    }
}
