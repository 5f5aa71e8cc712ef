//! The Python readers, in the same run on the same file.

use std::{path::Path, process::Command};

const SCRIPT: &str = include_str!("python_readers.py");

/// Prints their rates next to those of the `mcap` crate and of [`record_sensors`].
///
/// [`record_sensors`]: tipwatch_ingest::record_sensors
pub(crate) fn measure(path: &Path, stream_rate: f64, columns_rate: f64) {
    let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let output = Command::new(&python)
        .args(["-c", SCRIPT])
        .arg(path)
        .output();
    let output = match output {
        Ok(output) => output,
        Err(error) => return println!("Python: skipped, {python} does not start: {error}"),
    };
    if !output.status.success() {
        let problem = String::from_utf8_lossy(&output.stderr);
        let last = problem.lines().last().unwrap_or("it tells nothing");
        return println!("Python: skipped, {python}: {last}");
    }
    for line in String::from_utf8_lossy(&output.stdout).lines() {
        let fields: Vec<&str> = line.split('\t').collect();
        let numbers: Vec<f64> = fields
            .iter()
            .skip(1)
            .flat_map(|text| text.parse())
            .collect();
        let [name, ..] = fields[..] else { continue };
        let [messages, bytes, seconds] = numbers[..] else {
            println!("{line}");
            continue;
        };
        let rate = messages / seconds;
        println!(
            "{name:30}{seconds:8.3}{:23.1}{:7.3}{messages:17}  record_sensors is {:.0} times as fast",
            bytes * 1e-6 / seconds,
            rate / stream_rate,
            columns_rate / rate,
        );
    }
}
