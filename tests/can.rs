//! A machine heard over CAN: the numbers of a simulated log, sent as frames, give its loads again.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::Duration;

use mcap::WriteOptions;
use mcap::records::MessageHeader;
use tempfile::TempDir;
use tipwatch_analyze::analysis::Analysis;
use tipwatch_analyze::analysis::run::analyse;
use tipwatch_analyze::analysis::states;
use tipwatch_analyze::base::options::Options;
use tipwatch_analyze::setup::first_machine;
use tipwatch_analyze::setup::inspect::{Described, read_databases};
use tipwatch_binding::MachineFile;
use tipwatch_can::CandumpStream;
use tipwatch_ingest::{FieldRequest, Log, NumberField, record_fields};
use tipwatch_live::bridge::input::{Arrivals, CanInput, Intake, Teller, read_frames};
use tipwatch_live::bridge::session::{FirstMessages, Stamps};
use tipwatch_live::replay::LogSamples;
use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::state::Sensor;
use tipwatch_tests::data;

const JOINTS: [&str; 6] = ["lift", "tilt", "slew", "extension", "steer_fl", "steer_fr"];
const IMU_SOURCE: u8 = 0x21;

/// A frame: time (ns), identifier, whether it has 29 bits, data.
#[derive(Clone)]
struct Sent {
    time_ns: i64,
    id: u32,
    is_extended: bool,
    data: [u8; 8],
}

/// The numbers of the fields of a topic in `tiny.mcap`, row by row.
fn rows(topic: &str, fields: &[(&str, Option<&str>)]) -> (Vec<i64>, Vec<Vec<f64>>) {
    let log = Log::open(&data("tiny.mcap")).unwrap();
    let request = |(field, joint): &(&str, Option<&str>)| FieldRequest {
        number: NumberField {
            field: (*field).into(),
            joint: joint.map(str::to_owned),
            scale: 1.0,
            offset: 0.0,
        },
        ..FieldRequest::raw(topic, field)
    };
    let requests: Vec<FieldRequest> = fields.iter().map(request).collect();
    let (columns, _) = record_fields(&log, &requests, None).unwrap();
    let rows =
        (0..columns[0].values.len()).map(|row| columns.iter().map(|c| c.values[row]).collect());
    (columns[0].stamps_ns.clone(), rows.collect())
}

/// 16-bit parameters, lowest byte first, then bytes that say "not available".
fn parameters(values: &[(f64, f64, f64)]) -> [u8; 8] {
    let mut data = [0xff; 8];
    for (index, (value, scale, offset)) in values.iter().enumerate() {
        let raw = ((value - offset) / scale).round() as u16;
        data[2 * index..2 * index + 2].copy_from_slice(&raw.to_le_bytes());
    }
    data
}

/// `tiny.mcap` as frames, in the order of time.
fn frames() -> Vec<Sent> {
    let mut frames = Vec::new();
    for (index, joint) in JOINTS.into_iter().enumerate() {
        let fields = [("position", Some(joint)), ("velocity", Some(joint))];
        let (times, rows) = rows("/joint_states", &fields);
        for (count, (time_ns, row)) in times.into_iter().zip(rows).enumerate() {
            let [position, velocity] = match joint {
                "extension" => [row[0] * 1e3 / 0.01, row[1] * 1e3 / 0.01],
                _ => [row[0].to_degrees() / 0.0005, row[1].to_degrees() / 0.001],
            };
            let (position, velocity) = (position.round() as i32, velocity.round() as i32);
            let mut data = [0; 8];
            if joint == "tilt" {
                data[..4].copy_from_slice(&position.to_be_bytes());
                data[4..7].copy_from_slice(&velocity.to_be_bytes()[1..]);
            } else {
                data[..4].copy_from_slice(&position.to_le_bytes());
                data[4..7].copy_from_slice(&velocity.to_le_bytes()[..3]);
            }
            data[7] = count as u8;
            frames.push(Sent {
                time_ns,
                id: 257 + index as u32,
                is_extended: false,
                data,
            });
        }
    }
    let imu = [
        ("linear_acceleration.x", None),
        ("linear_acceleration.y", None),
        ("linear_acceleration.z", None),
        ("angular_velocity.x", None),
        ("angular_velocity.y", None),
        ("angular_velocity.z", None),
    ];
    let (times, rows_of_imu) = rows("/imu/data", &imu);
    for (time_ns, row) in times.into_iter().zip(rows_of_imu) {
        let acceleration = |value: f64| (value, 0.01, -320.0);
        let rate = |value: f64| (value.to_degrees(), 1.0 / 128.0, -250.0);
        let messages = [
            (
                61485,
                parameters(&[
                    acceleration(row[1]),
                    acceleration(row[0]),
                    acceleration(row[2]),
                ]),
            ),
            (
                61482,
                parameters(&[rate(row[4]), rate(row[3]), rate(row[5])]),
            ),
        ];
        frames.extend(messages.map(|(pgn, data)| Sent {
            time_ns,
            id: 3 << 26 | pgn << 8 | u32::from(IMU_SOURCE),
            is_extended: true,
            data,
        }));
    }
    let (times, speeds) = rows("/odom", &[("twist.twist.linear.x", None)]);
    for (time_ns, row) in times.into_iter().zip(speeds) {
        let raw = ((row[0] / 0.001).round() as i16).to_le_bytes();
        frames.push(Sent {
            time_ns,
            id: 272,
            is_extended: false,
            data: [raw[0], raw[1], 0, 0, 0, 0, 0, 0],
        });
    }
    frames.sort_by_key(|frame| frame.time_ns);
    frames
}

fn candump(frames: &[Sent]) -> String {
    let mut text = String::new();
    for frame in frames {
        let seconds = frame.time_ns / 1_000_000_000;
        let nanos = frame.time_ns % 1_000_000_000;
        let width = if frame.is_extended { 8 } else { 3 };
        let bytes: String = frame
            .data
            .iter()
            .map(|byte| format!("{byte:02X}"))
            .collect();
        writeln!(
            text,
            "({seconds}.{nanos:09}) can0 {:0width$X}#{bytes}",
            frame.id
        )
        .unwrap();
    }
    text
}

/// The frames as `can_msgs/Frame`, in the encoding of ROS 1 or ROS 2.
fn write_mcap(path: &Path, frames: &[Sent], encoding: &str) {
    let options = WriteOptions::new().compression(None).chunk_size(Some(4096));
    let file = std::fs::File::create(path).unwrap();
    let mut writer = options.create(file).unwrap();
    let (schema_encoding, name) = match encoding {
        "ros1" => ("ros1msg", "can_msgs/Frame"),
        _ => ("ros2msg", "can_msgs/msg/Frame"),
    };
    let definition = "std_msgs/Header header\nuint32 id\nbool is_rtr\nbool is_extended\nbool is_error\nuint8 dlc\nuint8[8] data\n";
    let schema = writer
        .add_schema(name, schema_encoding, definition.as_bytes())
        .unwrap();
    let channel = writer
        .add_channel(schema, "/can_bus", encoding, &BTreeMap::new())
        .unwrap();
    for (sequence, frame) in frames.iter().enumerate() {
        let stamp = [
            (frame.time_ns / 1_000_000_000) as u32,
            (frame.time_ns % 1_000_000_000) as u32,
        ];
        let mut bytes: Vec<u8> = Vec::new();
        let frame_id: &[u8] = match encoding {
            // sequence number first; a string without end, and no padding
            "ros1" => {
                bytes.extend((sequence as u32).to_le_bytes());
                &[0, 0, 0, 0]
            }
            _ => {
                bytes.extend([0, 1, 0, 0]);
                &[1, 0, 0, 0, 0, 0, 0, 0]
            }
        };
        bytes.extend(stamp.iter().flat_map(|part| part.to_le_bytes()));
        bytes.extend(frame_id);
        bytes.extend(frame.id.to_le_bytes());
        bytes.extend([0, u8::from(frame.is_extended), 0, 8]);
        bytes.extend(frame.data);
        let header = MessageHeader {
            channel_id: channel,
            sequence: sequence as u32,
            log_time: frame.time_ns as u64,
            publish_time: frame.time_ns as u64,
        };
        writer.write_to_known_channel(&header, &bytes).unwrap();
    }
    writer.finish().unwrap();
}

/// The folder with a log, the machine's URDF and the DBC file.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for name in ["tiny.urdf", "can_machine.dbc"] {
        std::fs::copy(data(name), folder.path().join(name)).unwrap();
    }
    folder
}

fn signals(topic: &str) -> String {
    let joint = |name: &str| {
        let of = |signal: &str| {
            format!(
                "{{ {topic}dbc = \"can_machine.dbc\", message = \"Joint_{name}\", signal = \"{signal}\" }}"
            )
        };
        format!(
            "[signals.joints.{name}]\nposition = {}\nvelocity = {}\n",
            of("Position"),
            of("Velocity")
        )
    };
    let group = |pgn: u32, names: [&str; 3]| {
        let numbers =
            names.map(|name| format!("{{ {topic}pgn = {pgn}, source = 33, signal = \"{name}\" }}"));
        numbers.join(", ")
    };
    let force = [
        "longitudinal_acceleration",
        "lateral_acceleration",
        "vertical_acceleration",
    ];
    JOINTS.map(joint).concat()
        + &format!(
            "[signals.imu]\nspecific_force = [{}]\nangular_velocity = [{}]\n",
            group(61485, force),
            group(61482, ["roll_rate", "pitch_rate", "yaw_rate"])
        )
        + &format!(
            "[signals.odometry]\nvelocity = [{{ {topic}dbc = \"can_machine.dbc\", message = \"Drive\", signal = \"Speed\" }}, 0, 0]\n"
        )
}

fn machine(folder: &Path, signals: &str) -> MachineFile {
    let text = std::fs::read_to_string(data("tiny.toml")).unwrap();
    let kept = text.split("[signals]").next().unwrap();
    MachineFile::from_text(&folder.join("machine.toml"), &format!("{kept}{signals}")).unwrap()
}

fn analysed(log: &Path, signals: &str) -> anyhow::Result<Analysis> {
    let file = machine(log.parent().unwrap(), signals);
    analyse(log, &file, Options::default(), &mut |_| {})
}

fn original() -> Analysis {
    let file = MachineFile::read(&data("tiny.toml")).unwrap();
    analyse(&data("tiny.mcap"), &file, Options::default(), &mut |_| {}).unwrap()
}

/// Returns the largest difference of wheel loads, as a share of the mean load, and the number of loads compared.
fn difference(left: &Analysis, right: &Analysis) -> (f64, usize) {
    let (mut largest, mut compared, mut sum) = (0.0_f64, 0, 0.0);
    for row in 0..left.rows.len() {
        let time = left.rows.times_ns[row];
        let Ok(other) = right.rows.times_ns.binary_search(&time) else {
            continue;
        };
        if !(left.rows.is_valid(row) && right.rows.is_valid(other)) {
            continue;
        }
        for wheel in 0..4 {
            let load =
                |of: &Analysis, row| of.rows.whole().outcomes.column(Quantity::Load(wheel))[row];
            let (a, b) = (load(left, row), load(right, other));
            largest = largest.max((a - b).abs());
            sum += a.abs();
            compared += 1;
        }
    }
    (
        largest / (sum / f64::from(compared.max(1))),
        compared as usize,
    )
}

#[test]
fn val_loads_over_can_are_those_of_the_original_within_quantisation() {
    let original = original();
    let frames = frames();
    let folder = folder();
    let path = |name: &str| -> PathBuf { folder.path().join(name) };
    std::fs::write(path("drive.log"), candump(&frames)).unwrap();
    write_mcap(&path("ros1.mcap"), &frames, "ros1");
    write_mcap(&path("ros2.mcap"), &frames, "cdr");
    let cases = [
        ("drive.log", String::new()),
        ("drive.log", "topic = \"can0\", ".to_owned()),
        ("ros1.mcap", String::new()),
        ("ros2.mcap", "topic = \"/can_bus\", ".to_owned()),
    ];
    for (name, topic) in cases {
        let analysis = analysed(&path(name), &signals(&topic)).unwrap();
        assert!(analysis.losses.is_empty(), "{name}: {:?}", analysis.losses);
        let (largest, compared) = difference(&original, &analysis);
        assert!(compared > 400, "{name}: {compared} loads compared");
        // accelerations come in steps of 0.01 m/s2, a thousandth of gravity
        assert!(
            largest < 0.01,
            "{name}: loads differ by {largest} of the mean load"
        );
        let notes = analysis.losses.notes.join("\n");
        assert!(notes.contains("deg is converted to rad"), "{name}: {notes}");
    }
}

/// The samples of a log as live: sensor, stamp, values.
type Sampled = Vec<(Sensor, i64, Vec<f64>)>;

/// Returns the samples and notes of the bridge for the messages after the first `first` ones, which it needs to begin with.
fn bridged(file: &MachineFile, arrivals: &Arrivals, first: usize) -> (Sampled, Vec<String>) {
    let urdf = file.urdf(None, None).unwrap();
    let mut begin = FirstMessages::default();
    let mut taken = 0;
    let mut next = || {
        let arrival = arrivals.next(Duration::from_secs(60));
        taken += usize::from(arrival.is_ok());
        arrival.ok().map(|arrival| (arrival, taken))
    };
    for _ in 0..first {
        begin.take(next().unwrap().0, &arrivals.lanes());
    }
    let lanes = arrivals.lanes();
    let bound = begin.bind(file, &urdf, &lanes, Stamps::Other, 0, 0);
    let mut assembly = bound.map_err(|incomplete| incomplete.0).unwrap();
    let mut samples = Vec::new();
    while let Some((arrival, _)) = next() {
        assembly.take(&arrival, &mut |sensor, stamp_ns, values| {
            samples.push((sensor, stamp_ns, values.to_vec()));
        });
        assembly.check_can().unwrap();
    }
    (samples, assembly.notes)
}

fn bits(samples: &[(Sensor, i64, Vec<f64>)]) -> Vec<(Sensor, i64, Vec<u64>)> {
    let values = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect();
    let one = |(sensor, stamp, of): &(Sensor, i64, Vec<f64>)| (*sensor, *stamp, values(of));
    samples.iter().map(one).collect()
}

/// The signals with the yaw rate in a message of its own: none, as that of the drive says.
fn split_axes() -> String {
    let rate = "{ pgn = 61482, source = 33, signal = \"yaw_rate\" }";
    let drive =
        "{ dbc = \"can_machine.dbc\", message = \"Drive\", signal = \"Speed\", scale = 0.0 }";
    let text = signals("");
    assert!(text.contains(rate));
    text.replace(rate, drive)
}

/// Inertial sensors on a CAN bus send the axes of a vector in several messages.
#[test]
fn axes_of_a_vector_may_come_in_several_messages() {
    let folder = folder();
    let path = folder.path().join("drive.log");
    std::fs::write(&path, candump(&frames())).unwrap();
    let imu = |signals: &str| -> Sampled {
        let read = LogSamples::read(&path, &machine(folder.path(), signals), None).unwrap();
        (read.samples())
            .filter(|(sample, _)| sample.sensor == Sensor::Imu)
            .map(|(sample, _)| (sample.sensor, sample.stamp_ns, sample.values.to_vec()))
            .collect()
    };
    let whole = imu(&signals(""));
    let split = imu(&split_axes());
    assert!(10 * split.len() > 9 * whole.len() && !split.is_empty());
    for (sensor, stamp_ns, values) in split {
        let mut same = whole
            .iter()
            .find(|(_, stamp, _)| *stamp == stamp_ns)
            .unwrap()
            .clone();
        same.2[5] = 0.0;
        assert_eq!(bits(&[(sensor, stamp_ns, values)]), bits(&[same]));
    }
}

/// An IMU over two parameter groups, joints and speed by DBC: the values that came over a pipe are those read from the file.
#[test]
fn bridged_frames_give_the_samples_of_the_log_bit_for_bit() {
    for signals in [signals(""), split_axes()] {
        bridged_frames_give_the_samples_of_the_log(&signals);
    }
}

fn bridged_frames_give_the_samples_of_the_log(signals: &str) {
    let folder = folder();
    let path = folder.path().join("drive.log");
    let text = candump(&frames());
    std::fs::write(&path, &text).unwrap();
    let file = machine(folder.path(), signals);
    let offline = LogSamples::read(&path, &file, None).unwrap();
    let offline: Sampled = offline
        .samples()
        .map(|(sample, _)| (sample.sensor, sample.stamp_ns, sample.values.to_vec()))
        .collect();
    let (reader, mut writer) = std::os::unix::net::UnixStream::pair().unwrap();
    let (intake, arrivals) = Intake::new(Teller::default());
    let writing = std::thread::spawn(move || {
        for (count, line) in text.lines().enumerate() {
            writeln!(writer, "{line}").unwrap();
            // slower than the queue takes frames
            if count % 200 == 0 {
                std::thread::sleep(Duration::from_millis(20));
            }
        }
    });
    let reading = std::thread::spawn(move || {
        let mut source = CandumpStream::new(std::io::BufReader::new(reader));
        let input: CanInput = "-".parse().unwrap();
        read_frames(&mut source, &input, &intake, &mut |frame| frame.time_ns).unwrap();
    });
    let (live, notes) = bridged(&file, &arrivals, 1500);
    writing.join().unwrap();
    reading.join().unwrap();
    assert!(live.len() > 800, "{} samples: {notes:?}", live.len());
    let (live, offline) = (bits(&live), bits(&offline));
    let rest = &offline[offline.len() - live.len()..];
    for (place, (live, offline)) in live.iter().zip(rest).enumerate() {
        assert_eq!(live, offline, "sample {place} of {}", rest.len());
    }
    // the IMU is interpolated between its two groups
    assert!(live.iter().any(|(sensor, ..)| *sensor == Sensor::Imu));
    assert!(
        arrivals
            .counts()
            .iter()
            .all(|c| c.flooded + c.without_room == 0)
    );
}

/// Two control units that send one parameter group: nobody knows which is meant.
#[test]
fn two_senders_of_a_message_end_the_bridged_session() {
    let folder = folder();
    let mut frames = frames();
    let text = signals("").replace("source = 33, ", "");
    let file = machine(folder.path(), &text);
    let (intake, arrivals) = Intake::new(Teller::default());
    let from = frames.len() * 3 / 4;
    for frame in frames.iter_mut().skip(from).step_by(7) {
        if frame.is_extended {
            frame.id = frame.id & !0xff | 0x42;
        }
    }
    let candump = candump(&frames);
    let reading = std::thread::spawn(move || {
        let mut source = CandumpStream::new(candump.as_bytes());
        let input: CanInput = "can7=can".parse().unwrap();
        assert_eq!(input.topic.as_deref(), Some("can"));
        let mut slowly = 0;
        read_frames(&mut source, &input, &intake, &mut |frame| {
            slowly += 1;
            if slowly % 200 == 0 {
                std::thread::sleep(Duration::from_millis(20));
            }
            frame.time_ns
        })
        .unwrap();
    });
    let urdf = file.urdf(None, None).unwrap();
    let mut begin = FirstMessages::default();
    for _ in 0..1500 {
        let arrival = arrivals.next(Duration::from_secs(60)).unwrap();
        begin.take(arrival, &arrivals.lanes());
    }
    let bound = begin.bind(&file, &urdf, &arrivals.lanes(), Stamps::Other, 0, 0);
    let mut assembly = bound.map_err(|incomplete| incomplete.0).unwrap();
    assembly.check_can().unwrap();
    while let Ok(arrival) = arrivals.next(Duration::from_secs(60)) {
        assembly.take(&arrival, &mut |_, _, _| {});
    }
    reading.join().unwrap();
    let error = assembly.check_can().unwrap_err().to_string();
    assert!(error.contains("PGN6148"), "{error}");
}

/// The session does not begin without a sensor of the machine file, and names the missing one.
#[test]
fn a_bridged_session_does_not_begin_without_every_sensor() {
    let folder = folder();
    let mut frames = frames();
    frames.retain(|frame| frame.id >> 8 & 0xffff != 61482);
    let text = candump(&frames);
    let file = machine(folder.path(), &signals(""));
    let (intake, arrivals) = Intake::new(Teller::default());
    let mut source = CandumpStream::new(text.as_bytes());
    let input: CanInput = "-".parse().unwrap();
    read_frames(&mut source, &input, &intake, &mut |frame| frame.time_ns).unwrap();
    drop(intake);
    let mut begin = FirstMessages::default();
    while let Ok(arrival) = arrivals.next(Duration::ZERO) {
        begin.take(arrival, &arrivals.lanes());
    }
    let urdf = file.urdf(None, None).unwrap();
    let bound = begin.bind(&file, &urdf, &arrivals.lanes(), Stamps::Other, 0, 0);
    let error = format!("{:#}", bound.unwrap_err().0);
    assert!(error.contains("PGN61482"), "{error}");
}

#[test]
fn states_are_read_over_can_as_an_analysis_reads_them() {
    let folder = folder();
    let path = folder.path().join("drive.log");
    std::fs::write(&path, candump(&frames())).unwrap();
    let file = machine(folder.path(), &signals(""));
    let analysis = analysed(&path, &signals("")).unwrap();
    let (_, rows) = states(&path, &file, &Options::default()).unwrap();
    assert!(!rows.is_empty() && rows.times_ns == analysis.rows.times_ns);
}

#[test]
fn what_is_not_a_number_never_reaches_the_loads() {
    let clean = frames();
    let folder = folder();
    let path = folder.path().join("faulty.log");
    std::fs::write(&path, candump(&clean)).unwrap();
    let undisturbed = analysed(&path, &signals("")).unwrap();
    let mut faulty = clean.clone();
    let mut seen: BTreeMap<u32, usize> = BTreeMap::new();
    for frame in &mut faulty {
        let count = seen.entry(frame.id).or_default();
        *count += 1;
        match (frame.id, *count) {
            // error and "not available" in one axis of the accelerations
            (id, 40) if id >> 8 & 0xffff == 61485 => {
                frame.data[2..4].copy_from_slice(&[0xff, 0xff]);
            }
            (id, 41) if id >> 8 & 0xffff == 61485 => {
                frame.data[4..6].copy_from_slice(&[0x00, 0xfe]);
            }
            // a position far outside its range
            (259, 30) => frame.data[..4].copy_from_slice(&[0xff, 0xff, 0xff, 0x7f]),
            _ => {}
        }
    }
    // a controller that repeats its last frame
    let place = faulty.iter().rposition(|frame| frame.id == 257).unwrap();
    let mut repeated = faulty[place / 2..]
        .iter()
        .find(|frame| frame.id == 257)
        .unwrap()
        .clone();
    repeated.time_ns += 1_000_000;
    faulty.push(repeated);
    faulty.sort_by_key(|frame| frame.time_ns);
    std::fs::write(&path, candump(&faulty)).unwrap();
    let analysis = analysed(&path, &signals("")).unwrap();
    let (largest, compared) = difference(&undisturbed, &analysis);
    assert!(
        compared > 400 && largest < 0.05,
        "{compared} loads, difference {largest}"
    );
    let notes = analysis.losses.notes.join("\n");
    for expected in [
        "longitudinal_acceleration: 1 values say \"not available\"",
        "vertical_acceleration: 1 values say \"error\"",
        "Joint_slew.Position: 1 values lie outside the stated range",
        "1 of",
        "repeat the message counter",
    ] {
        assert!(
            notes.contains(expected),
            "\"{expected}\" is not in: {notes}"
        );
    }
}

#[test]
fn several_senders_and_buses_are_refused_until_one_is_named() {
    let folder = folder();
    let path = folder.path().join("two.log");
    let mut frames = frames();
    let mut other: Vec<Sent> = frames
        .iter()
        .filter(|frame| frame.is_extended)
        .cloned()
        .collect();
    for frame in &mut other {
        frame.id = frame.id & !0xff | 0x22;
    }
    frames.extend(other);
    frames.sort_by_key(|frame| frame.time_ns);
    std::fs::write(&path, candump(&frames)).unwrap();
    let unnamed = signals("").replace(", source = 33", "");
    let error = format!("{:#}", analysed(&path, &unnamed).unwrap_err());
    assert!(error.contains("source addresses 33, 34"), "{error}");
    assert!(analysed(&path, &signals("")).is_ok());
    // the same frames on two buses
    let text = candump(&frames);
    let both = text.clone() + &text.replace(" can0 ", " can1 ");
    std::fs::write(&path, both).unwrap();
    let error = format!("{:#}", analysed(&path, &signals("")).unwrap_err());
    assert!(
        error.contains("can0, can1") && error.contains("topic ="),
        "{error}"
    );
    assert!(analysed(&path, &signals("topic = \"can1\", ")).is_ok());
}

#[test]
fn what_is_wrong_with_a_can_signal_is_said() {
    let folder = folder();
    let path = folder.path().join("drive.log");
    std::fs::write(&path, candump(&frames())).unwrap();
    let lift = |binding: &str| format!("[signals.joints.lift]\nposition = {{ {binding} }}\n");
    let cases: [(&str, &[&str]); 5] = [
        (
            "dbc = \"none.dbc\", message = \"A\", signal = \"B\"",
            &["none.dbc", "cannot be read"],
        ),
        (
            "dbc = \"tiny.urdf\", message = \"A\", signal = \"B\"",
            &["tiny.urdf", "not a valid DBC file"],
        ),
        (
            "dbc = \"can_machine.dbc\", message = \"Joint\", signal = \"B\"",
            &["expected the message Joint", "Joint_lift"],
        ),
        (
            "dbc = \"can_machine.dbc\", message = \"Joint_lift\", signal = \"B\"",
            &["expected the signal B", "Position, Velocity"],
        ),
        (
            "pgn = 61443, signal = \"speed\"",
            &["61443", "61481", "name a DBC file"],
        ),
    ];
    for (binding, parts) in cases {
        let error = format!("{:#}", analysed(&path, &lift(binding)).unwrap_err());
        for part in parts {
            assert!(error.contains(part), "\"{part}\" is not in: {error}");
        }
    }
    let text = std::fs::read_to_string(data("tiny.toml")).unwrap();
    let kept = text.split("[signals]").next().unwrap();
    let wrong = lift("dbc = \"can_machine.dbc\", signal = \"Position\"");
    let error = MachineFile::from_text(&folder.path().join("m.toml"), &format!("{kept}{wrong}"))
        .unwrap_err();
    assert!(
        error
            .to_string()
            .contains("{ topic, dbc, message, signal }"),
        "{error}"
    );
}

/// Writes the first machine file of a log.
fn write_first(log: &Path, urdf: &Path, out: &Path, databases: &[Described]) {
    let options = first_machine::WriteOptions::default();
    let draft = first_machine::draft(log, Some(urdf), out, databases, options).unwrap();
    first_machine::write(&draft).unwrap();
}

#[test]
fn a_first_machine_file_binds_joints_and_imu_of_a_bus() {
    let folder = folder();
    let log = folder.path().join("bus.log");
    std::fs::write(&log, candump(&frames())).unwrap();
    let [urdf, dbc, out] =
        ["tiny.urdf", "can_machine.dbc", "first.toml"].map(|name| folder.path().join(name));
    let databases = read_databases(&[dbc], None).unwrap();
    write_first(&log, &urdf, &out, &databases);
    let file = MachineFile::read(&out).unwrap();
    let signals = &file.spec.signals;
    let bound: Vec<&str> = signals.joints.keys().map(String::as_str).collect();
    let mut joints = JOINTS;
    joints.sort_unstable();
    assert_eq!(bound, joints);
    assert!(
        signals
            .imu
            .as_ref()
            .is_some_and(|imu| imu.fields().is_some())
    );
    // relative to the machine file, so that both can be moved
    let opened = file.open_log(&log).unwrap();
    let topics: Vec<&str> = opened
        .topics()
        .iter()
        .map(|topic| topic.name.as_str())
        .collect();
    for name in ["can/Joint_lift", "can/PGN61485@33", "can/PGN61482@33"] {
        assert!(topics.contains(&name), "{topics:?}");
    }
    let text = std::fs::read_to_string(&out).unwrap();
    assert!(text.contains("dbc = \"can_machine.dbc\""), "{text}");
}

#[test]
fn a_first_machine_file_takes_the_speed_of_the_front_axle_where_no_other_is_on_the_bus() {
    let folder = folder();
    let [log, urdf, out] =
        ["bus.log", "tiny.urdf", "first.toml"].map(|name| folder.path().join(name));
    let speed = |pgn: u32, time_ns| Sent {
        time_ns,
        id: 6 << 26 | pgn << 8 | 11,
        is_extended: true,
        data: [0, 4, 125, 125, 125, 125, 125, 125],
    };
    for (pgns, taken) in [
        (
            &[65215][..],
            "pgn = 65215, source = 11, signal = \"front_axle_speed\"",
        ),
        (
            &[65215, 65265],
            "pgn = 65265, source = 11, signal = \"wheel_based_vehicle_speed\"",
        ),
    ] {
        let mut all = frames();
        let times: Vec<i64> = all.iter().map(|frame| frame.time_ns).collect();
        for &pgn in pgns {
            all.extend(times.iter().step_by(10).map(|&time_ns| speed(pgn, time_ns)));
        }
        all.sort_by_key(|frame| frame.time_ns);
        std::fs::write(&log, candump(&all)).unwrap();
        write_first(&log, &urdf, &out, &[]);
        let text = std::fs::read_to_string(&out).unwrap();
        assert!(text.contains(taken), "{text}");
        std::fs::remove_file(&out).unwrap();
    }
}

/// A first machine file of the bus, with the description changed.
fn first_machine_of(described: impl Fn(String) -> String) -> String {
    let folder = folder();
    let log = folder.path().join("bus.log");
    std::fs::write(&log, candump(&frames())).unwrap();
    let [urdf, dbc, out] =
        ["tiny.urdf", "can_machine.dbc", "first.toml"].map(|name| folder.path().join(name));
    let text = described(std::fs::read_to_string(&dbc).unwrap());
    std::fs::write(&dbc, text).unwrap();
    let databases = read_databases(&[dbc], None).unwrap();
    write_first(&log, &urdf, &out, &databases);
    std::fs::read_to_string(&out).unwrap()
}

#[test]
fn a_joint_of_another_name_is_proposed_by_unit_and_motion() {
    let text = first_machine_of(|dbc| dbc.replace("Joint_lift", "Sensor7"));
    let line =
        "# position = { dbc = \"can_machine.dbc\", message = \"Sensor7\", signal = \"Position\" }";
    assert!(
        text.contains(&format!("# [signals.joints.lift]\n{line}")),
        "{text}"
    );
    // rates and what is bound are no candidates
    let others = text
        .lines()
        .filter(|line| line.starts_with("# By name, unit and motion"));
    assert_eq!(others.count(), 1, "{text}");
    assert!(!text.contains("Sensor7\", signal = \"Velocity\""), "{text}");
    // another word for the same motion is enough
    let text = first_machine_of(|dbc| dbc.replace("Joint_extension", "Telescope"));
    let line =
        "position = { dbc = \"can_machine.dbc\", message = \"Telescope\", signal = \"Position\" }";
    assert!(
        text.contains(&format!("[signals.joints.extension]\n{line}")),
        "{text}"
    );
}

/// Names as makers give them: a signal that alone has its name and unit is bound, and no other.
#[test]
fn a_first_machine_file_binds_no_joint_to_the_signal_of_another() {
    let folder = folder();
    let [log, urdf, dbc, out] =
        ["bus.log", "tiny.urdf", "names.dbc", "first.toml"].map(|name| folder.path().join(name));
    let mut all = frames();
    let loads = all.iter().filter(|frame| frame.id == 257).step_by(20);
    let loads: Vec<Sent> = loads
        .map(|frame| Sent {
            id: 273,
            data: [210, 0, 144, 1, 55, 0, 0, 0],
            ..frame.clone()
        })
        .collect();
    all.extend(loads);
    all.sort_by_key(|frame| frame.time_ns);
    std::fs::write(&log, candump(&all)).unwrap();
    let named = [
        ("'lift'", "'boom'"),
        ("'extension'", "'boom_extension'"),
        ("'tilt'", "'forks'"),
        ("'slew'", "'turret'"),
    ];
    let mut text = std::fs::read_to_string(&urdf).unwrap();
    for (tiny, name) in named {
        text = text.replace(
            &format!("<joint name={tiny}"),
            &format!("<joint name={name}"),
        );
    }
    std::fs::write(&urdf, text).unwrap();
    let imu = 1u32 << 31 | 3 << 26 | 61485 << 8 | u32::from(IMU_SOURCE);
    let described = format!(
        r#"VERSION ""
BU_: Crane
BO_ 257 BoomStatus: 8 Crane
 SG_ Boom_Angle : 0|32@1- (0.0005,0) [-360|360] "deg" Crane
BO_ 258 Attachment: 8 Crane
 SG_ Fork_Angle : 7|32@0- (0.0005,0) [-360|360] "deg" Crane
BO_ 259 Upper: 8 Crane
 SG_ Orientation : 0|32@1- (0.0005,0) [-360|360] "deg" Crane
BO_ 260 Telescope: 8 Crane
 SG_ Boom_Extension : 0|32@1- (0.01,0) [-20000|20000] "mm" Crane
BO_ 273 Hook: 8 Crane
 SG_ HookLoad : 0|16@1+ (0.01,0) [0|60] "t" Crane
 SG_ Rated_Load : 16|16@1+ (0.01,0) [0|60] "t" Crane
 SG_ LMI_Load : 32|8@1+ (1,0) [0|250] "%" Crane
BO_ {imu} Inclination: 8 Crane
 SG_ LatAcc : 0|16@1+ (0.01,-320) [-320|322.55] "m/s2" Crane
"#
    );
    std::fs::write(&dbc, described).unwrap();
    let databases = read_databases(&[dbc], None).unwrap();
    write_first(&log, &urdf, &out, &databases);
    let text = std::fs::read_to_string(&out).unwrap();
    let signals = MachineFile::read(&out).unwrap().spec.signals;
    let bound: Vec<&str> = signals.joints.keys().map(String::as_str).collect();
    assert_eq!(bound, ["boom", "boom_extension", "forks"], "{text}");
    let of = |message: &str, signal: &str| {
        format!("{{ dbc = \"names.dbc\", message = \"{message}\", signal = \"{signal}\"")
    };
    for (joint, message, signal) in [
        ("boom", "BoomStatus", "Boom_Angle"),
        ("boom_extension", "Telescope", "Boom_Extension"),
        ("forks", "Attachment", "Fork_Angle"),
        ("# turret", "Upper", "Orientation"),
    ] {
        let (open, joint) = joint.split_once(' ').unwrap_or(("", joint));
        let gap = if open.is_empty() { "" } else { " " };
        let position = of(message, signal);
        let lines =
            format!("{open}{gap}[signals.joints.{joint}]\n{open}{gap}position = {position}");
        assert!(text.contains(&lines), "{lines} is not in {text}");
    }
    // the mass on the hook, and neither what may hang there nor how much of it does
    let masses: Vec<&str> = text
        .lines()
        .filter(|line| line.starts_with("# mass = "))
        .collect();
    assert_eq!(masses.len(), 1, "{text}");
    assert!(masses[0].contains(&of("Hook", "HookLoad")), "{text}");
    // the public group has the whole acceleration, whatever a DBC file makes of its frames
    assert!(
        signals.imu.is_some_and(|imu| imu.fields().is_some()),
        "{text}"
    );
}

/// Groups that need no DBC file, from frames to the results.
#[test]
fn val_speeds_and_weights_of_public_groups_reach_the_results() {
    let folder = folder();
    let log = folder.path().join("bus.log");
    let (times, _) = rows("/odom", &[("twist.twist.linear.x", None)]);
    let sent = |pgn: u32, data: [u8; 8]| {
        let frames = times.iter().map(move |&time_ns| Sent {
            time_ns,
            id: 6 << 26 | pgn << 8 | 11,
            is_extended: true,
            data,
        });
        frames.collect::<Vec<_>>()
    };
    let mut all = frames();
    // 9 km/h, which is 2.5 m/s
    all.extend(sent(65265, [0xff, 0, 9, 0xff, 0xff, 0xff, 0xff, 0xff]));
    all.extend(sent(65215, [0, 9, 125, 125, 125, 125, 125, 125]));
    all.extend(sent(65134, [0, 9, 0, 9, 0, 9, 0, 9]));
    // the first axle, and 320 kg of cargo
    all.extend(sent(65258, [0, 0x10, 0x27, 0xff, 0xff, 160, 0, 0xff]));
    all.sort_by_key(|frame| frame.time_ns);
    std::fs::write(&log, candump(&all)).unwrap();
    let drive = "dbc = \"can_machine.dbc\", message = \"Drive\", signal = \"Speed\"";
    for (pgn, signal) in [
        (65265, "wheel_based_vehicle_speed"),
        (65215, "front_axle_speed"),
        (65134, "rear_left_wheel_speed"),
    ] {
        let group = format!("pgn = {pgn}, source = 11, signal = \"{signal}\"");
        let file = machine(folder.path(), &signals("").replace(drive, &group));
        let samples = LogSamples::read(&log, &file, None).unwrap();
        let odometry = samples
            .samples()
            .filter(|(it, _)| it.sensor == Sensor::Odometry);
        let speeds: Vec<f64> = odometry.map(|(sample, _)| sample.values[0]).collect();
        assert!(speeds.len() > 20, "{group}: {speeds:?}");
        assert!(
            speeds.iter().all(|speed| (speed - 2.5).abs() < 1e-12),
            "{group}: {speeds:?}"
        );
    }
    let weight = "[[payload]]\nlink = \"tool\"\nmass_sigma = 5.0\nmass = { signal = { pgn = 65258, source = 11, signal = \"cargo_weight\" } }\n";
    let empty = analysed(&log, &signals("")).unwrap();
    let loaded = analysed(&log, &(signals("") + weight)).unwrap();
    let stated = "[[payload]]\nlink = \"tool\"\nmass = 320.0\n";
    let stated = analysed(&log, &(signals("") + stated)).unwrap();
    let (to_stated, rows) = difference(&loaded, &stated);
    assert!(rows > 100 && to_stated < 1e-9, "{to_stated}, {rows} rows");
    assert!(difference(&loaded, &empty).0 > 0.01);
}
