//! The bridge: messages from networks become the samples, and the verdicts, of the same messages in a log.

use std::ops::ControlFlow;
use std::path::Path;
use std::time::{Duration, Instant};

use tipwatch_analyze::analysis::run;
use tipwatch_analyze::base::options::{Estimator, Options};
use tipwatch_binding::MachineFile;
use tipwatch_ingest::Log;
use tipwatch_live::bridge::input::{Arrival, Intake, Lane, LaneId, Teller};
use tipwatch_live::bridge::session::{Assembly, Ending, FirstMessages, SessionRun, Stamps};
use tipwatch_live::replay::LogSamples;
use tipwatch_live::wire::session::Session;
use tipwatch_live::wire::topics::{SAMPLE_QUEUE, WireVerdict};
use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::state::Sensor;
use tipwatch_mechanics::verdict::{InputFault, Level};

use crate::arm_forces::with_forces;
use crate::support::killing::Reading;
use crate::support::{LIMIT, World, data};

/// The messages of a log as they would arrive, each topic from a publisher of its own.
fn arrivals(path: &Path) -> (Vec<Lane>, Vec<Arrival>) {
    let log = Log::open(path).unwrap();
    let (intake, _queue) = Intake::new(Teller::default());
    let mut lanes = Vec::new();
    let ids: Vec<LaneId> = (log.topics().iter())
        .map(|topic| {
            let lane = Lane {
                name: topic.name.clone(),
                type_name: topic.type_name.clone(),
                definition: topic.definition.clone().unwrap_or_default(),
                is_bus: false,
            };
            lanes.push(lane.clone());
            intake.lane(&lane)
        })
        .collect();
    let mut arrivals = Vec::new();
    let mut sequences = vec![0_u64; ids.len()];
    let topics: Vec<_> = log.topics().iter().map(|topic| topic.id).collect();
    log.read(&topics, &mut |message| {
        let at = message.topic.index();
        sequences[at] += 1;
        arrivals.push(Arrival {
            lane: ids[at],
            host_ns: message.log_time_ns,
            log_ns: message.log_time_ns,
            sent_ns: Some(message.publish_time_ns),
            publisher: 7 + at as u128,
            sequence: Some(sequences[at]),
            missed: 0,
            data: message.data.to_vec(),
        });
        ControlFlow::Continue(())
    })
    .unwrap();
    arrivals.sort_by_key(|arrival| arrival.log_ns);
    (lanes, arrivals)
}

/// The machine bound to the first messages.
fn begun(file: &MachineFile, lanes: &[Lane], first: &[Arrival]) -> (Assembly, FirstMessages) {
    let urdf = file.urdf(None, None).unwrap();
    let mut begin = FirstMessages::default();
    for arrival in first {
        begin.take(arrival.clone(), lanes);
    }
    let bound = begin.bind(file, &urdf, lanes, Stamps::Other, 0, 0);
    let assembly = bound.map_err(|incomplete| incomplete.0).unwrap();
    (assembly, begin)
}

fn machine(name: &str) -> MachineFile {
    MachineFile::read(&data(&format!("{name}.toml"))).unwrap()
}

/// The crane with a load cell, a scale, and with the rate that is asked of its slewing joint.
fn crane_with_loads_and_commands() -> MachineFile {
    let path = data("crane.toml");
    let text = std::fs::read_to_string(&path).unwrap()
        + "[signals.wheels.OFL]\nload = { topic = \"/outriggers/force\", field = \"data[0]\" }\n\
           [signals.joints.slew]\ncommand = { topic = \"/joint_states\", field = \"velocity\", joint = \"slew\" }\n\
           [[payload]]\nlink = \"load\"\nmass_sigma = 5.0\n\
           mass = { signal = { topic = \"/outriggers/force\", field = \"data[1]\", scale = 1e-3 } }\n";
    MachineFile::from_text(&path, &text).unwrap()
}

#[test]
fn bridged_messages_give_the_samples_of_the_log_bit_for_bit() {
    let names = [
        "tiny",
        "tiny_lift",
        "forwarder6",
        "bogie_drive",
        "corner_brake",
    ];
    let mut machines: Vec<(&str, MachineFile)> =
        names.iter().map(|name| (*name, machine(name))).collect();
    machines.push(("crane", crane_with_loads_and_commands()));
    let folder = tempfile::tempdir().unwrap();
    let forces = with_forces(folder.path(), "");
    machines.push(("lift_payload", MachineFile::read(&forces).unwrap()));
    for (name, file) in machines {
        let path = data(&format!("{name}.mcap"));
        let (lanes, arrivals) = arrivals(&path);
        let first = arrivals.len() / 4;
        let (mut assembly, _) = begun(&file, &lanes, &arrivals[..first]);
        let mut live: Vec<(Sensor, i64, Vec<u64>)> = Vec::new();
        let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        for arrival in &arrivals[first..] {
            assembly.take(arrival, &mut |sensor, stamp_ns, values| {
                live.push((sensor, stamp_ns, bits(values)));
            });
        }
        let offline = LogSamples::read(&path, &file, None).unwrap();
        let offline: Vec<(Sensor, i64, Vec<u64>)> = offline
            .samples()
            .map(|(sample, _)| (sample.sensor, sample.stamp_ns, bits(sample.values)))
            .collect();
        assert!(live.len() > 100, "{name}: {} samples", live.len());
        let rest = &offline[offline.len() - live.len()..];
        assert!(
            live == rest,
            "{name}: {:?}",
            live.iter().zip(rest).position(|(a, b)| a != b)
        );
        let session = LogSamples::read(&path, &file, None).unwrap().session;
        assert_eq!(assembly.session.streams, session.streams, "{name}");
        assert_eq!(
            assembly.session.machine_hash, session.machine_hash,
            "{name}"
        );
        assert_eq!(
            assembly.session.actuated_joints, session.actuated_joints,
            "{name}"
        );
        let beside = |session: &Session| {
            let Session {
                switches,
                load_sensors,
                joint_commands,
                payload_signals,
                force_signals,
                ..
            } = session.clone();
            [
                switches,
                load_sensors,
                joint_commands,
                payload_signals,
                force_signals,
            ]
        };
        assert_eq!(beside(&assembly.session), beside(&session), "{name}");
        if name == "crane" {
            assert_eq!(beside(&session).map(|it| it.len()), [5, 1, 1, 1, 0]);
        }
        if name == "lift_payload" {
            assert_eq!(beside(&session).map(|it| it.len()), [0, 0, 0, 0, 3]);
        }
    }
}

/// A log of these messages.
fn write_log(path: &Path, lanes: &[Lane], messages: &[Arrival]) {
    let file = std::fs::File::create_new(path).unwrap();
    let options = mcap::WriteOptions::new().compression(None);
    let mut writer = options.create(std::io::BufWriter::new(file)).unwrap();
    let mut channels = Vec::new();
    for lane in lanes {
        let schema = writer.add_schema(&lane.type_name, "ros2msg", lane.definition.as_bytes());
        let schema = schema.unwrap();
        let none = std::collections::BTreeMap::new();
        channels.push(
            writer
                .add_channel(schema, &lane.name, "cdr", &none)
                .unwrap(),
        );
    }
    for message in messages {
        let header = mcap::records::MessageHeader {
            channel_id: channels[message.lane.0],
            sequence: 0,
            log_time: message.log_ns as u64,
            publish_time: message.sent_ns.unwrap() as u64,
        };
        writer
            .write_to_known_channel(&header, &message.data)
            .unwrap();
    }
    writer.finish().unwrap();
}

/// Waits until the monitor has joined the session and lags no further behind.
fn wait_for_reader(run: &mut SessionRun, most_behind: u64) {
    let start = Instant::now();
    while run
        .backlog()
        .unwrap()
        .is_none_or(|behind| behind > most_behind)
    {
        assert!(start.elapsed() < LIMIT, "the monitor reads no samples");
        run.maintain().unwrap();
        std::thread::sleep(Duration::from_micros(100));
    }
}

#[test]
fn bridged_verdicts_equal_those_of_analyze_with_the_causal_estimator() {
    let world = World::new("bridged");
    let (path, file) = (data("tiny_lift.mcap"), machine("tiny_lift"));
    let (lanes, arrivals) = arrivals(&path);
    let first = 200;
    let cut = world.state.path().join("cut.mcap");
    write_log(&cut, &lanes, &arrivals[first..]);
    let options = Options {
        estimator: Estimator::Causal,
        ..Options::default()
    };
    let offline = run::analyse(&cut, &file, options, &mut |_| {}).unwrap();

    let monitor = world.monitor(
        &data("tiny_lift.toml"),
        &["--json", "--allow-untimed", "--wake", "poll"],
    );
    world.wait_for_verdict(|_| true);
    let (mut assembly, begin) = begun(&file, &lanes, &arrivals[..first]);
    // as fast as the monitor reads: no delay is checked, and nothing is lost on a busy computer
    assembly.session.pace = 0.0;
    assembly.session.wants_progress = true;
    let node = world.join();
    let publishers = begin.into_publishers();
    let mut run = SessionRun::begin(&node, assembly, publishers, lanes, Teller::default()).unwrap();
    wait_for_reader(&mut run, 0);
    for arrival in &arrivals[first..] {
        wait_for_reader(&mut run, SAMPLE_QUEUE as u64 / 2);
        assert_eq!(run.take(arrival).unwrap(), None);
    }
    let counts = run.end().unwrap();
    assert_eq!(counts.sent as usize, arrivals.len() - first);
    let monitor = monitor.end();
    let rows: Vec<serde_json::Value> = (monitor.out.lines())
        .map(|line| serde_json::from_str(line).unwrap())
        .filter(|value: &serde_json::Value| value["event"] == "row")
        .collect();
    assert_eq!(rows.len(), offline.rows.len(), "{}", monitor.err);
    let verdicts = offline.rows.whole().verdicts.as_ref().unwrap();
    let mut levels = std::collections::BTreeSet::new();
    for (row, live) in rows.iter().enumerate() {
        assert_eq!(live["time_ns"], offline.rows.times_ns[row]);
        assert_eq!(live["verdict"], verdicts.verdicts[row].level.name());
        levels.insert(verdicts.verdicts[row].level.name());
        for (wheel, name) in ["fl", "fr", "rl", "rr"].iter().enumerate() {
            let load = offline.rows.whole().outcomes.column(Quantity::Load(wheel))[row];
            match live["load_n"][name].as_f64() {
                // the reader of JSON is exact to the last bits
                Some(live) => assert!((live - load).abs() <= 1e-9 * load.abs(), "{live} {load}"),
                None => assert!(!load.is_finite()),
            }
        }
    }
    assert!(
        levels.contains("assumed") && levels.contains("danger"),
        "{levels:?}"
    );
}

/// A session in shared memory with a monitor, fed in real time from a log whose stamps are moved to now.
struct Trial {
    world: World,
    monitor: crate::support::Process,
    arrivals: Vec<Arrival>,
    lanes: Vec<Lane>,
    first: usize,
}

impl Trial {
    /// Index of the lane of a topic.
    fn lane(&self, topic: &str) -> usize {
        let mut lanes = self.lanes.iter();
        lanes.position(|lane| lane.name == topic).unwrap()
    }

    fn new(test: &str) -> Self {
        let world = World::new(test);
        let (lanes, arrivals) = arrivals(&data("tiny.mcap"));
        let monitor = world.monitor(&data("tiny.toml"), &["--json", "--stay", "--wake", "poll"]);
        world.wait_for_verdict(|_| true);
        Self {
            world,
            monitor,
            first: arrivals.len() / 4,
            lanes,
            arrivals,
        }
    }

    /// Feeds messages from the first ones on, changed by `change`, in real time; returns how it ended and all verdicts.
    fn run(
        self,
        mut change: impl FnMut(usize, Arrival) -> Vec<Arrival>,
    ) -> (
        Option<Ending>,
        tipwatch_live::bridge::session::SessionCounts,
        Vec<serde_json::Value>,
    ) {
        let file = machine("tiny");
        let (mut assembly, begin) = begun(&file, &self.lanes, &self.arrivals[..self.first]);
        let node = self.world.join();
        let start_log_ns = self.arrivals[self.first].log_ns;
        let start = Instant::now() + Duration::from_millis(700);
        let host = tipwatch_live::system::clock::monotonic_ns() + 700_000_000;
        // where the clock of the stamps stands, moved with the messages
        assembly.session.clock.host_ns += host - start_log_ns;
        let publishers = vec![Default::default(); begin.into_publishers().len()];
        let mut run = SessionRun::begin(
            &node,
            assembly,
            publishers,
            self.lanes.clone(),
            Teller::default(),
        )
        .unwrap();
        let mut ending = None;
        'all: for (count, arrival) in self.arrivals[self.first..].iter().enumerate() {
            let due = Duration::from_nanos((arrival.log_ns - start_log_ns) as u64);
            while start.elapsed() < due || Instant::now() < start {
                run.maintain().unwrap();
                std::thread::sleep(Duration::from_micros(300));
            }
            let mut arrival = arrival.clone();
            arrival.host_ns += host - start_log_ns;
            for changed in change(count, arrival) {
                ending = run.take(&changed).unwrap();
                if ending.is_some() {
                    break 'all;
                }
            }
        }
        std::thread::sleep(Duration::from_millis(300));
        let counts = run.end().unwrap();
        std::thread::sleep(Duration::from_millis(300));
        self.monitor.signal("-INT");
        let monitor = self.monitor.end();
        let verdicts = monitor
            .out
            .lines()
            .map(|line| serde_json::from_str(line).unwrap());
        (ending, counts, verdicts.collect())
    }
}

/// Levels and faults of the verdicts after the first row.
fn seen(verdicts: &[serde_json::Value], what: &str) -> usize {
    verdicts
        .iter()
        .filter(|v| v.to_string().contains(what))
        .count()
}

#[test]
fn two_publishers_stop_the_topic_and_the_monitor_faults() {
    let trial = Trial::new("two");
    let imu = trial.lane("/imu/data");
    let (ending, counts, verdicts) = trial.run(|count, arrival| {
        let mut second = arrival.clone();
        second.publisher += 100;
        match arrival.lane.0 == imu && (200..260).contains(&count) {
            true => vec![arrival, second],
            false => vec![arrival],
        }
    });
    assert_eq!(ending, None);
    assert!(counts.of_two_publishers > 20, "{counts:?}");
    assert!(seen(&verdicts, "\"stale\"") > 0, "no fault");
}

#[test]
fn lost_messages_are_lost_samples_for_the_monitor() {
    let trial = Trial::new("loss");
    let imu = trial.lane("/imu/data");
    let (_, counts, verdicts) = trial.run(|count, arrival| {
        let is_lost = arrival.lane.0 == imu && (150..400).contains(&count) && count % 3 == 0;
        if is_lost { Vec::new() } else { vec![arrival] }
    });
    assert!(counts.lost > 20, "{counts:?}");
    assert!(seen(&verdicts, "\"lost\"") > 0, "no fault");
}

#[test]
fn a_clock_that_goes_back_and_a_new_publisher_end_the_session() {
    let file = machine("tiny");
    let (lanes, arrivals) = arrivals(&data("tiny.mcap"));
    let first = arrivals.len() / 4;
    let endings = |test: &str, change: &dyn Fn(&mut Arrival)| {
        let world = World::new(test);
        let (assembly, begin) = begun(&file, &lanes, &arrivals[..first]);
        let node = world.join();
        let publishers = begin.into_publishers();
        let mut run = SessionRun::begin(
            &node,
            assembly,
            publishers,
            lanes.clone(),
            Teller::default(),
        )
        .unwrap();
        for arrival in &arrivals[first..] {
            assert_eq!(run.take(arrival).unwrap(), None);
        }
        let mut again = arrivals[first].clone();
        again.host_ns = arrivals.last().unwrap().host_ns + 2_000_000_000;
        again.sequence = Some(1_000_000);
        change(&mut again);
        run.take(&again).unwrap()
    };
    // the log begins again
    let back = endings("back", &|_| {});
    assert!(
        matches!(&back, Some(Ending::Restart(why)) if why.contains("go back by")),
        "{back:?}"
    );
    let new = endings("newpub", &|arrival| arrival.publisher += 1);
    assert!(
        matches!(&new, Some(Ending::Restart(why)) if why.contains("another publisher")),
        "{new:?}"
    );
    let moved = endings("moved", &|arrival| {
        arrival.data = arrivals
            .iter()
            .rfind(|a| a.lane == arrival.lane)
            .unwrap()
            .data
            .clone();
        arrival.host_ns += 60_000_000_000;
    });
    assert!(
        matches!(&moved, Some(Ending::Restart(why)) if why.contains("away from where")),
        "{moved:?}"
    );
}

#[test]
fn a_damaged_message_is_counted_or_gives_the_sample_of_the_intact_one() {
    let file = machine("tiny");
    let (lanes, arrivals) = arrivals(&data("tiny.mcap"));
    let first = arrivals.len() / 4;
    let (mut assembly, _) = begun(&file, &lanes, &arrivals[..first]);
    let (mut intact, _) = begun(&file, &lanes, &arrivals[..first]);
    let mut undecodable = 0;
    for (count, arrival) in arrivals[first..].iter().enumerate() {
        let mut expected = Vec::new();
        intact.take(arrival, &mut |sensor, stamp_ns, values| {
            let bits: Vec<u64> = values.iter().map(|v| v.to_bits()).collect();
            expected.push((sensor, stamp_ns, bits));
        });
        let mut damaged = arrival.clone();
        damaged.data.truncate(count % arrival.data.len());
        let mut found = Vec::new();
        let refusals = assembly.take(&damaged, &mut |sensor, stamp_ns, values| {
            let bits: Vec<u64> = values.iter().map(|v| v.to_bits()).collect();
            found.push((sensor, stamp_ns, bits));
        });
        undecodable += refusals.map_or(0, |r| r.undecodable);
        // what is cut off behind the last number that is needed does no harm
        assert!(found.is_empty() || found == expected, "message {count}");
    }
    assert!(undecodable > 100, "{undecodable}");
}

#[test]
fn a_message_type_in_the_place_of_another_is_refused_with_the_reason() {
    let file = machine("tiny");
    let (mut lanes, arrivals) = arrivals(&data("tiny.mcap"));
    let odometry = lanes
        .iter()
        .find(|lane| lane.name == "/odom")
        .unwrap()
        .clone();
    for lane in lanes.iter_mut().filter(|lane| lane.name == "/imu/data") {
        lane.type_name = odometry.type_name.clone();
        lane.definition = odometry.definition.clone();
    }
    let urdf = file.urdf(None, None).unwrap();
    let mut begin = FirstMessages::default();
    for arrival in &arrivals {
        begin.take(arrival.clone(), &lanes);
    }
    let bound = begin.bind(&file, &urdf, &lanes, Stamps::Other, 0, 0);
    let error = format!("{:#}", bound.unwrap_err().0);
    assert!(
        error.contains("/imu/data") && error.contains("sensor_msgs/msg/Imu"),
        "{error}"
    );
}

/// Needs a network that carries DDS between processes of this computer.
mod needs_dds {
    use super::*;

    /// `play` as the machine, `bridge` and `monitor` as on it: the program as a user runs it.
    #[test]
    #[ignore = "needs a network that carries DDS"]
    fn a_log_played_on_dds_is_judged() {
        let world = World::new("dds");
        let domain = (100 + std::process::id() % 100).to_string();
        let machine = data("tiny_lift.toml");
        let monitor = world.monitor(&machine, &["--stay", "--quiet"]);
        let arguments = [
            "bridge",
            "--machine",
            machine.to_str().unwrap(),
            "--dds",
            &domain,
        ];
        let bridge = world.start(&arguments);
        let node = world.join();
        let reading = Reading::new(&node);
        let mut play = std::process::Command::new(env!("CARGO_BIN_EXE_tipwatch-live"))
            .args([
                "play",
                data("tiny_lift.mcap").to_str().unwrap(),
                "--dds",
                &domain,
            ])
            .spawn()
            .unwrap();
        reading.wait_for("danger", |verdict: &WireVerdict| {
            verdict.verdict().level == Level::Danger
        });
        assert!(play.wait().unwrap().success());
        // nobody publishes any more
        reading.wait_for("a fault", |verdict| {
            verdict.conditions().faults.has(InputFault::Stale)
        });
        bridge.signal("-INT");
        let bridge = bridge.end();
        assert!(bridge.status.success(), "{}", bridge.err);
        assert!(bridge.err.contains("1 sessions"), "{}", bridge.err);
        monitor.signal("-INT");
        monitor.end();
    }
}

/// Needs Python with the packages of `ros2/publisher.py`; `TIPWATCH_PYTHON` names it.
mod needs_ros2 {
    use super::*;

    /// A publisher in Python by Cyclone DDS, broken in one way: what the bridge says and what the monitor sees.
    fn broken(fault: &str, place: u32) -> (String, String) {
        let world = World::new(fault);
        let domain = (place + std::process::id() % 60).to_string();
        let machine = data("corner_brake.toml");
        let monitor = world.monitor(&machine, &["--stay", "--json"]);
        let arguments = [
            "bridge",
            "--machine",
            machine.to_str().unwrap(),
            "--dds",
            &domain,
            "--wait",
            "12",
        ];
        let bridge = world.start(&arguments);
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/ros2/publisher.py");
        let python = std::env::var("TIPWATCH_PYTHON").unwrap_or_else(|_| "python3".into());
        let played = std::process::Command::new(python)
            .arg(script)
            .arg(&domain)
            .arg(data("corner_brake.mcap"))
            .arg(fault)
            .output()
            .unwrap();
        assert!(
            played.status.success(),
            "{}",
            String::from_utf8_lossy(&played.stderr)
        );
        std::thread::sleep(Duration::from_millis(700));
        bridge.signal("-INT");
        let bridge = bridge.end().err;
        monitor.signal("-INT");
        let out = String::from_utf8_lossy(&played.stdout).into_owned();
        (format!("{bridge}{out}"), monitor.end().out)
    }

    #[test]
    #[ignore = "needs Python with cyclonedds"]
    fn messages_of_cyclone_dds_are_judged_and_diagnostics_read_there() {
        let (told, verdicts) = broken("diagnostics", 100);
        assert!(
            told.contains("/imu/data: sensor_msgs/msg/Imu, best effort"),
            "{told}"
        );
        assert!(
            told.contains("tipwatch: tip-over | assumed, worst wheel"),
            "{told}"
        );
        assert!(verdicts.contains("\"event\":\"row\""), "{told}");
    }

    #[test]
    #[ignore = "needs Python with cyclonedds"]
    fn faults_of_publishers_are_told_and_never_safe() {
        for (fault, words, seen) in [
            ("two", "expected one publisher, found two", "\"stale\""),
            (
                "restart",
                "another publisher has taken the place",
                "\"stale\"",
            ),
            (
                "type",
                "found one of nav_msgs/msg/Odometry",
                "\"event\":\"row\"",
            ),
            ("flood", "more than 2000 messages per second", "\"lost\""),
            ("silent_imu", "1 sessions", "\"stale\""),
            ("back", "stamps go back by", "\"event\":\"row\""),
        ] {
            let (told, verdicts) = broken(fault, 110);
            assert!(told.contains(words), "{fault}: {told}");
            assert!(verdicts.contains(seen), "{fault}: {told}");
        }
        let (told, verdicts) = broken("only_wrong_type", 120);
        assert!(
            told.contains("expected publishers of sensor_msgs/msg/Imu"),
            "{told}"
        );
        let is_calm = |level| verdicts.contains(&format!("\"verdict\":\"{level}\""));
        assert!(!is_calm("safe") && !is_calm("assumed"), "{told}");
    }
}

/// Needs Python with the packages of `examples/zenoh_to_bridge.py`; `TIPWATCH_PYTHON` names it.
mod needs_zenoh {
    use std::process::{Command, Stdio};

    use super::*;

    #[test]
    #[ignore = "needs Python with eclipse-zenoh"]
    fn messages_of_zenoh_are_judged_and_their_losses_seen() {
        let world = World::new("zenoh");
        let crate_folder = Path::new(env!("CARGO_MANIFEST_DIR"));
        let python = std::env::var("TIPWATCH_PYTHON").unwrap_or_else(|_| "python3".into());
        let machine = data("corner_brake.toml");
        let machine = machine.to_str().unwrap();
        let endpoint = format!("tcp/127.0.0.1:{}", 20_000 + std::process::id() % 10_000);
        let monitor = world.monitor(&data("corner_brake.toml"), &["--stay", "--json"]);
        let mut publisher = Command::new(&python)
            .arg(crate_folder.join("tests/ros2/zenoh_publisher.py"))
            .args([
                "7",
                data("corner_brake.mcap").to_str().unwrap(),
                &endpoint,
                "10",
            ])
            .spawn()
            .unwrap();
        let mut reader = Command::new(&python)
            .arg(crate_folder.join("examples/zenoh_to_bridge.py"))
            .args([
                "--domain",
                "7",
                "--connect",
                &endpoint,
                "/joint_states",
                "/imu/data",
                "/odom",
            ])
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let bridge = Command::new(env!("CARGO_BIN_EXE_tipwatch-live"))
            .args([
                "bridge",
                "--mcap",
                "--machine",
                machine,
                "--prefix",
                &world.prefix,
            ])
            .stdin(reader.stdout.take().unwrap())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        assert!(publisher.wait().unwrap().success());
        // the end of its input ends the bridge
        reader.kill().unwrap();
        reader.wait().unwrap();
        let bridge = bridge.wait_with_output().unwrap();
        let told = String::from_utf8_lossy(&bridge.stderr);
        // messages were lost
        assert_eq!(bridge.status.code(), Some(3), "{told}");
        assert!(told.contains("/imu/data: 1 messages lost"), "{told}");
        assert!(told.contains("1 sessions"), "{told}");
        monitor.signal("-INT");
        let out = monitor.end().out;
        assert!(
            out.contains("\"event\":\"row\"") && out.contains("\"lost\""),
            "{told}"
        );
    }
}
