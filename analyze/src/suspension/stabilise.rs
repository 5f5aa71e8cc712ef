//! The suspension optimiser over standard input and output, see [`tipwatch_suspension::protocol`].

use std::io::{BufRead, Read, Write};

use anyhow::{Context, Result, anyhow, bail};
use serde::Serialize;
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::machine::{ControlMode, LogFacts, Machine};
use tipwatch_suspension::protocol::{LineControl, Opening};

/// Far above any line of the protocol.
const LINE_LIMIT_BYTES: u64 = 1 << 20;

/// Serves one client until it closes its input. `mode` and `step_s` override the machine file. However the input ends,
/// the last answer closes the valves.
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
    let opening = Opening::parse(text(&first)?)?;
    let machine = machine(file, &opening)?;
    let suspension = machine
        .suspension()
        .ok_or_else(|| anyhow!("{}: expected [suspension], found none", file.path.display()))?;
    let mut control = suspension.control.clone();
    control.mode = mode.unwrap_or(control.mode);
    control.rate = step_s.map_or(control.rate, |step| 1.0 / step);
    let (mut line_control, ready) = LineControl::new(&machine, &opening, &control)?;
    write_line(&mut output, &ready)?;
    let ended = loop {
        let line = match next_line(&mut input) {
            Ok(Some(line)) => line,
            Ok(None) => break Ok(()),
            Err(error) => break Err(error),
        };
        let answer = match text(&line) {
            Ok(line) if line.trim().is_empty() => continue,
            Ok(line) => line_control.answer(line),
            Err(error) => line_control.refuse(error.to_string()),
        };
        write_line(&mut output, &answer)?;
    };
    write_line(&mut output, &line_control.end())?;
    ended
}

/// The next line; `None` at the end of the input.
fn next_line(input: &mut impl BufRead) -> Result<Option<Vec<u8>>> {
    let mut bytes = Vec::new();
    let read = input.take(LINE_LIMIT_BYTES).read_until(b'\n', &mut bytes);
    match read.context("standard input: cannot be read")? as u64 {
        0 => Ok(None),
        LINE_LIMIT_BYTES if !bytes.ends_with(b"\n") => {
            bail!("standard input: expected lines of less than {LINE_LIMIT_BYTES} bytes")
        }
        _ => Ok(Some(bytes)),
    }
}

/// A line without its end.
fn text(line: &[u8]) -> Result<&str> {
    let line = std::str::from_utf8(line).context("expected a line of UTF-8")?;
    let line = line.strip_suffix('\n').unwrap_or(line);
    Ok(line.strip_suffix('\r').unwrap_or(line))
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
        // the end of the input closes the valves
        assert_eq!(answers[5]["reasons"], serde_json::json!(["ended"]));
        assert_eq!(answers[5]["opening"], serde_json::json!([0.0, 0.0]));
        assert_eq!(answers.len(), 6);
    }

    /// Returns the output of the program before it gave up, and the error that ended it.
    fn said(input: &[u8]) -> (Vec<serde_json::Value>, Result<()>) {
        let file = MachineFile::read(Path::new(DATA)).unwrap();
        let mut output = Vec::new();
        let ended = serve(&file, None, None, input, &mut output);
        let text = String::from_utf8(output).unwrap();
        let lines = text.lines().map(|l| serde_json::from_str(l).unwrap());
        (lines.collect(), ended)
    }

    #[test]
    fn damaged_lines_close_the_valves_and_the_session_goes_on() {
        let good = request([Some(-0.1), Some(-0.1)], 9.8066);
        let mut input = format!("{}\n{good}\n", first()).into_bytes();
        input.extend_from_slice(b"{\"joints\": \"\xff\xfe\"}\n");
        input.extend_from_slice(&good.as_bytes()[..good.len() / 2]);
        input.extend_from_slice(b"\n");
        input.extend_from_slice(good.replace("9.8066", "1e999").as_bytes());
        input.extend_from_slice(b"\n");
        input.extend_from_slice(good.replace("9.8066", "NaN").as_bytes());
        let (answers, ended) = said(&input);
        ended.unwrap();
        assert_eq!(answers[1]["hold"], false, "{}", answers[1]);
        assert_eq!(answers.len(), 7, "{answers:?}");
        for answer in &answers[2..6] {
            assert_eq!(answer["hold"], true, "{answer}");
            assert!(answer["error"].is_string(), "{answer}");
        }
        assert!(answers[2]["error"].as_str().unwrap().contains("UTF-8"));
        assert_eq!(answers[6]["reasons"][0], "ended");
    }

    #[test]
    fn an_input_that_breaks_off_closes_the_valves_last() {
        let good = request([Some(-0.1), Some(-0.1)], 9.8066);
        let mut input = format!("{}\n{good}\n", first()).into_bytes();
        input.resize(input.len() + LINE_LIMIT_BYTES as usize, b'x');
        let (answers, ended) = said(&input);
        assert!(ended.unwrap_err().to_string().contains("1048576 bytes"));
        assert_eq!(answers[1]["hold"], false);
        assert_eq!(answers[2]["hold"], true);
        assert_eq!(answers[2]["opening"], serde_json::json!([0.0, 0.0]));
        assert_eq!(answers.len(), 3);
    }

    #[test]
    fn another_version_of_the_protocol_is_refused() {
        let said = |version: u32| first().replacen('{', &format!("{{\"protocol\": {version}, "), 1);
        assert_eq!(talk(&[said(1)]).unwrap()[0]["protocol"], 1);
        let refused = talk(&[said(2)]).unwrap_err().to_string();
        assert_eq!(refused, "first line: protocol: expected 1, found 2");
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
