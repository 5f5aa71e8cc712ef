//! Fixtures, the program under test, and its output.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;
use tipwatch_analyze::analysis::Analysis;
use tipwatch_analyze::analysis::run::analyse;
use tipwatch_analyze::base::options::Options;
use tipwatch_binding::MachineFile;

/// A fixture of the repository.
pub(crate) fn data(name: &str) -> PathBuf {
    let crate_folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = crate_folder.join("../tests/data").canonicalize();
    folder.unwrap().join(name)
}

/// A log beside the repository, for ignored tests.
pub(crate) fn shared(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/logs");
    let path = path.join(name);
    assert!(path.exists(), "expected {}, found none", path.display());
    path
}

pub(crate) fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

pub(crate) fn command(args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tipwatch"));
    command.args(args);
    command
}

/// Arguments: a command, a log or folder, its machine, and where the results go.
pub(crate) fn into<'a>(
    command: &'a str,
    log: &'a Path,
    machine: &'a Path,
    out: &'a Path,
) -> [&'a str; 6] {
    let [log, machine, out] = [log, machine, out].map(text);
    [command, log, "--machine", machine, "--out", out]
}

pub(crate) fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

/// Runs the program.
pub(crate) fn tipwatch(args: &[&str]) -> Output {
    command(args).output().unwrap()
}

pub(crate) fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

pub(crate) fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// Runs a Python script, with `TIPWATCH_PYTHON` or else `python3`; its messages say what is missing.
pub(crate) fn run_python(arguments: &[&str]) {
    let python = std::env::var("TIPWATCH_PYTHON").unwrap_or("python3".into());
    let output = Command::new(&python).args(arguments).output();
    let output = output.unwrap_or_else(|error| panic!("{python}: {error}"));
    let messages = stdout(&output) + &stderr(&output);
    assert!(
        output.status.success(),
        "{python} {arguments:?}: {messages}"
    );
}

/// Exit code and standard error.
pub(crate) fn code_and_stderr(output: &Output) -> (i32, String) {
    (output.status.code().unwrap(), stderr(output))
}

/// Analyses a log with default options.
pub(crate) fn analysed(log: &Path, machine: &Path) -> Analysis {
    let file = MachineFile::read(machine).unwrap();
    analyse(log, &file, Options::default(), &mut |_| {}).unwrap()
}

/// A message of a log that is copied.
pub(crate) struct Copied<'m> {
    pub(crate) topic: &'m str,
    /// Log time after the first message (s); may be changed, too.
    pub(crate) time_s: f64,
    pub(crate) data: Vec<u8>,
}

/// Copies an MCAP file; `edit` may change each message, and keeps it if it returns true. `later` are
/// log times (s after the first message) of further messages, on a topic that no machine uses. The channels
/// stay, even those that lose all messages.
pub(crate) fn copy_log(
    from: &Path,
    to: &Path,
    later: &[f64],
    edit: &mut dyn FnMut(&mut Copied<'_>) -> bool,
) {
    let bytes = fs::read(from).unwrap();
    let messages = mcap::MessageStream::new(&bytes)
        .unwrap()
        .map(Result::unwrap);
    let messages: Vec<mcap::Message<'_>> = messages.collect();
    let mut writer = mcap::Writer::new(fs::File::create(to).unwrap()).unwrap();
    let mut channels = std::collections::BTreeMap::new();
    for message in &messages {
        let channel = &message.channel;
        channels.entry(channel.topic.clone()).or_insert_with(|| {
            let schema = channel.schema.as_ref().unwrap();
            let schema = writer
                .add_schema(&schema.name, &schema.encoding, &schema.data)
                .unwrap();
            let none = std::collections::BTreeMap::new();
            writer
                .add_channel(schema, &channel.topic, &channel.message_encoding, &none)
                .unwrap()
        });
    }
    let other = writer
        .add_schema("std_msgs/msg/String", "ros2msg", b"string data\n")
        .unwrap();
    let none = std::collections::BTreeMap::new();
    let other = writer.add_channel(other, "/other", "cdr", &none).unwrap();
    let first = messages
        .iter()
        .map(|message| message.log_time)
        .min()
        .unwrap();
    let mut write = |channel_id: u16, log_time: u64, data: &[u8]| {
        let header = mcap::records::MessageHeader {
            channel_id,
            sequence: 0,
            log_time,
            publish_time: log_time,
        };
        writer.write_to_known_channel(&header, data).unwrap();
    };
    for message in &messages {
        let mut copied = Copied {
            topic: &message.channel.topic,
            time_s: (message.log_time - first) as f64 * 1e-9,
            data: message.data.to_vec(),
        };
        if edit(&mut copied) {
            let log_time = first + (copied.time_s * 1e9).round() as u64;
            write(channels[&message.channel.topic], log_time, &copied.data);
        }
    }
    for &time_s in later {
        let text = [0, 1, 0, 0, 2, 0, 0, 0, b'x', 0];
        write(other, (first as f64 + time_s * 1e9) as u64, &text);
    }
    writer.finish().unwrap();
}

/// Replaces every number of an IMU message by NaN: attitude, angular velocity, specific force and their
/// covariances are its last 37 numbers.
pub(crate) fn fill_imu_with_nan(data: &mut [u8]) {
    let numbers = data.len() - 37 * 8;
    for number in data[numbers..].chunks_exact_mut(8) {
        number.copy_from_slice(&f64::NAN.to_le_bytes());
    }
}
