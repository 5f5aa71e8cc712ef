//! The health of the sensors in the summary.

use serde_json::Value;
use tempfile::TempDir;

use super::support::{data, tipwatch};

#[test]
fn every_sensor_of_an_analysis_has_its_health() {
    let folder = TempDir::new().unwrap();
    let (log, machine) = (data("corner_brake.mcap"), data("corner_brake.toml"));
    let [log, machine, out] =
        [&log, &machine, folder.path()].map(|path| path.to_str().unwrap().to_owned());
    let output = tipwatch(&["analyze", &log, "--machine", &machine, "--out", &out]);
    assert!(output.status.success(), "{output:?}");
    let summary = std::fs::read(folder.path().join("summary.json")).unwrap();
    let summary: Value = serde_json::from_slice(&summary).unwrap();
    let (health, inputs) = (&summary["health"], summary["inputs"].as_array().unwrap());
    for (k, input) in inputs.iter().enumerate() {
        let sensor = &health[k];
        assert_eq!(sensor["signal"], input["signal"]);
        assert_eq!(sensor["topic"], input["topic"]);
        assert_eq!(sensor["clock_steps"], 0);
        assert_eq!(sensor["rate_changes"], Value::Array(Vec::new()));
        let rates = [&sensor["rate_hz"], &input["timing"]["rate_hz"]];
        let [median, mean] = rates.map(|rate| rate.as_f64().unwrap());
        assert!((median / mean - 1.0).abs() < 0.05, "{median} and {mean}");
        for number in sensor["numbers"].as_array().unwrap() {
            assert_eq!(number["samples"], sensor["samples"], "{number}");
        }
    }
    let sensors = health.as_array().unwrap();
    let imu = sensors.iter().find(|it| it["signal"] == "imu").unwrap();
    let vertical = &imu["numbers"][2];
    assert_eq!(vertical["name"], "specific_force_z");
    let value = |key: &str| vertical[key].as_f64().unwrap();
    assert!(
        value("least") < 9.8 && value("greatest") > 9.8,
        "{vertical}"
    );
    assert!(value("vibration_rms") > 0.0, "{vertical}");
    assert!(value("greatest_vibration_rms") >= value("vibration_rms"));
    assert_eq!(vertical["clipped_share"], 0.0);
}
