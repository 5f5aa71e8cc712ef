//! Logs made from tables of numbers are analysed like any other.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use tempfile::TempDir;
use tipwatch_analyze::analysis::Analysis;
use tipwatch_analyze::analysis::run::analyse;
use tipwatch_analyze::base::options::Options;
use tipwatch_binding::MachineFile;
use tipwatch_ingest::{
    Log, SensorKind, SensorRecording, SensorRequest, first_frame, record_sensors,
};
use tipwatch_mechanics::Quantity;

#[path = "../examples/csv_to_mcap.rs"]
mod csv_to_mcap;

use csv_to_mcap::{TableFormat, convert};

use super::support::data;

const JOINTS: [&str; 6] = ["lift", "tilt", "slew", "extension", "steer_fl", "steer_fr"];
const START_NS: i64 = 1_780_000_000_000_000_000;
const STANDARD_GRAVITY: f64 = 9.80665;

/// Units of the tables: degrees and millimetres, g, degrees per second, kilometres per hour.
const MACHINE: &str = r#"
[signals.joints.lift]
position = { topic = "/can/joints", field = "lift_deg", scale = 0.017453292519943295 }
velocity = { topic = "/can/joints", field = "lift_rate_deg_s", scale = 0.017453292519943295 }
[signals.joints.tilt]
position = { topic = "/can/joints", field = "tilt_deg", scale = 0.017453292519943295 }
[signals.joints.slew]
position = { topic = "/can/joints", field = "slew_deg", scale = -0.017453292519943295, offset = 1.5707963267948966 }
[signals.joints.extension]
position = { topic = "/can/joints", field = "extension_mm", scale = 0.001, offset = -0.05 }
[signals.joints.steer_fl]
position = { topic = "/can/joints", field = "steer_fl" }
[signals.joints.steer_fr]
position = { topic = "/can/joints", field = "steer_fr" }
[signals.imu]
specific_force = [
  { topic = "/can/acceleration", field = "ax_g", scale = 9.80665 },
  { topic = "/can/acceleration", field = "ay_g", scale = 9.80665 },
  { topic = "/can/acceleration", field = "az_g", scale = 9.80665 },
]
angular_velocity = [
  { topic = "/can/rates", field = "wx", scale = 0.017453292519943295 },
  { topic = "/can/rates", field = "wy", scale = 0.017453292519943295 },
  { topic = "/can/rates", field = "wz", scale = 0.017453292519943295 },
]
roll_pitch_yaw = [
  { topic = "/can/tilt", field = "roll_deg", scale = 0.017453292519943295 },
  { topic = "/can/tilt", field = "pitch_deg", scale = 0.017453292519943295 },
  0,
]
[signals.odometry]
velocity = [{ topic = "/can/speed", field = "km_h", scale = 0.2777777777777778 }, 0, 0]
"#;

fn recorded(log: &Log, kind: SensorKind) -> SensorRecording {
    let topic = log.topics().iter().find(|t| kind.is_type(&t.type_name));
    let request = SensorRequest::typed(
        topic.unwrap().id,
        kind,
        match kind {
            SensorKind::JointStates => JOINTS.map(str::to_owned).to_vec(),
            _ => Vec::new(),
        },
    );
    record_sensors(log, &[request], &mut |_| {})
        .unwrap()
        .0
        .remove(0)
}

/// A table of some numbers of each sample, in milliseconds from the start.
fn table(
    folder: &Path,
    name: &str,
    head: &str,
    recording: &SensorRecording,
    line: impl Fn(usize, &[f64]) -> String,
) -> (String, PathBuf) {
    let mut text = format!("time (ms),{head}\n");
    for (i, stamp) in recording.stamps_ns.iter().enumerate() {
        let time_ms = (stamp - START_NS) as f64 * 1e-6;
        writeln!(text, "{time_ms},{}", line(i, recording.sample(i))).unwrap();
    }
    let path = folder.join(format!("{name}.csv"));
    fs::write(&path, text).unwrap();
    (format!("/can/{name}"), path)
}

/// Everything that `tiny.mcap` has of the six joints, IMU and odometry, as tables in other units, some
/// cells empty.
fn tables(folder: &Path) -> Vec<(String, PathBuf)> {
    let log = Log::open(&data("tiny.mcap")).unwrap();
    let (joints, imu, odometry) = (
        recorded(&log, SensorKind::JointStates),
        recorded(&log, SensorKind::Imu),
        recorded(&log, SensorKind::Odometry),
    );
    let deg = f64::to_degrees;
    let head =
        "lift (deg),lift rate (deg/s),tilt (deg),slew (deg),extension [mm],steer-fl,steer_fr";
    let of_joints = |i: usize, v: &[f64]| {
        let slew = match i % 2 {
            0 => format!("{}", 90.0 - deg(v[2])),
            _ => String::new(),
        };
        let extension = v[3] * 1e3 + 50.0;
        format!(
            "{},{},{},{slew},{extension},{},{}",
            deg(v[0]),
            deg(v[6]),
            deg(v[1]),
            v[4],
            v[5]
        )
    };
    let scaled = |v: &[f64], by: f64| -> String {
        let cells: Vec<String> = v.iter().map(|v| format!("{}", v * by)).collect();
        cells.join(",")
    };
    vec![
        table(folder, "joints", head, &joints, of_joints),
        table(folder, "acceleration", "ax_g,ay_g,az_g", &imu, |_, v| {
            scaled(&v[..3], 1.0 / STANDARD_GRAVITY)
        }),
        table(folder, "rates", "wx,wy,wz", &imu, |_, v| {
            scaled(&v[3..6], deg(1.0))
        }),
        table(folder, "tilt", "roll_deg,pitch_deg", &imu, |_, v| {
            let [x, y, z, w] = v[6..] else { panic!() };
            let roll = (2.0 * (w * x + y * z)).atan2(1.0 - 2.0 * (x * x + y * y));
            let pitch = (2.0 * (w * y - z * x)).asin();
            format!("{},{}", deg(roll), deg(pitch))
        }),
        table(folder, "speed", "km/h", &odometry, |_, v| {
            format!("{}", v[0] * 3.6)
        }),
    ]
}

fn format() -> TableFormat {
    TableFormat {
        time_column: Some("time (ms)".into()),
        time_unit_ns: 1e6,
        start_s: START_NS as f64 * 1e-9,
        ..TableFormat::default()
    }
}

fn mean_of(analysis: &Analysis, quantity: Quantity) -> f64 {
    let column = analysis.rows.whole().outcomes.column(quantity);
    let valid: Vec<f64> = (0..analysis.rows.len())
        .filter(|&row| analysis.rows.is_valid(row))
        .map(|row| column[row])
        .collect();
    valid.iter().sum::<f64>() / valid.len() as f64
}

#[test]
fn val_a_log_from_csv_tables_gives_the_same_loads() {
    let folder = TempDir::new().unwrap();
    let made = folder.path().join("made.mcap");
    let count = convert(&tables(folder.path()), &made, &format()).unwrap();
    assert!(count > 500, "{count}");
    let text = fs::read_to_string(data("tiny.toml")).unwrap();
    let kept = text.split("[signals]").next().unwrap().to_owned();
    let analysed = |log: &Path, signals: &str| {
        let file = MachineFile::from_text(&data("tiny.toml"), &(kept.clone() + signals)).unwrap();
        analyse(log, &file, Options::default(), &mut |_| {}).unwrap()
    };
    let typed = analysed(&data("tiny.mcap"), "");
    let tabled = analysed(&made, MACHINE);
    let valid = |analysis: &Analysis| {
        (0..analysis.rows.len())
            .filter(|&row| analysis.rows.is_valid(row))
            .count()
    };
    assert!(valid(&tabled) > 100 && valid(&tabled) + 10 > valid(&typed));
    for wheel in 0..4 {
        let [a, b] = [&typed, &tabled].map(|of| mean_of(of, Quantity::Load(wheel)));
        // half of the slew angles and most of the velocities are missing; a wrong unit costs thousands of newtons
        assert!((a - b).abs() < 0.005 * 8590.0, "wheel {wheel}: {a} {b}");
    }
    let slope = |analysis: &Analysis| {
        let mut state = tipwatch_mechanics::State::zero(&analysis.machine);
        analysis
            .rows
            .whole()
            .states
            .get(analysis.rows.len() / 2, &mut state);
        state.base.up
    };
    assert!((slope(&typed) - slope(&tabled)).norm() < 1e-3);
    // integrity, definitions and stamps are those of any log
    let log = Log::open(&made).unwrap();
    assert_eq!(first_frame(&log, log.topics()[0].id).unwrap(), None);
    assert!(
        tabled
            .inputs
            .iter()
            .all(|i| i.clock.starts_with("header.stamp"))
    );
}

#[test]
fn invalid_tables_are_rejected() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("out.mcap");
    let says = |text: &str, format: &TableFormat| {
        let path = folder.path().join("table.csv");
        fs::write(&path, text).unwrap();
        let tables = [("/t".to_owned(), path)];
        convert(&tables, &out, format).map_err(|error| error.to_string())
    };
    let plain = TableFormat::default();
    for (text, parts) in [
        ("t,gear\n0,1\n1,N\n", &["column \"gear\"", "--skip"][..]),
        ("t,a b,a-b\n0,1,2\n", &["different names", "\"a_b\""]),
        ("t,a\n0,1\n,1\n", &["line 3", "\"t\"", "time"]),
        ("t,a\n0,1,2\n", &["table.csv"]),
        ("", &["table.csv"]),
    ] {
        let messages = says(text, &plain).unwrap_err();
        assert!(
            parts.iter().all(|part| messages.contains(part)),
            "{messages}"
        );
    }
    let german = TableFormat {
        delimiter: b';',
        skipped: vec!["gear".into()],
        ..plain
    };
    assert_eq!(says("t;a;gear\n0,5;1,25;N\n", &german), Ok(1));
    let again = says("t;a\n0;1\n", &german).unwrap_err();
    assert!(
        again.contains("out.mcap") && again.contains("exists"),
        "{again}"
    );
}
