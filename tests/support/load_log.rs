//! Logs with measured wheel loads: copies of simulated logs with the simulator's contact forces as load cells.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;

use mcap::records::MessageHeader;
use mcap::{WriteOptions, Writer};
use tipwatch_ingest::{Log, TopicId};

/// The topic of the loads.
pub const LOADS: &str = "/wheel_loads";
const DEFINITION: &str = "std_msgs/Header header\nfloat64 fl\nfloat64 fr\nfloat64 rl\nfloat64 rr\n\
================================================================================\n\
MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n\
================================================================================\n\
MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";

/// Copies a log with a topic [`LOADS`] beside the others: fields `fl`, `fr`, `rl` and `rr` (N) at these times (ns).
///
/// # Panics
/// If the log cannot be read or the copy cannot be written.
pub fn write_with_loads(from: &Path, to: &Path, loads: &[(i64, [f64; 4])]) {
    let log = Log::open(from).expect("a log");
    let file = std::io::BufWriter::new(std::fs::File::create(to).expect("a new file"));
    let mut writer: Writer<_> = WriteOptions::new().create(file).expect("a writer");
    let mut channels: BTreeMap<TopicId, u16> = BTreeMap::new();
    for topic in log.topics() {
        let definition = topic.definition.as_deref().unwrap_or_default().as_bytes();
        let schema = writer.add_schema(&topic.type_name, &topic.schema_encoding, definition);
        let channel = writer.add_channel(
            schema.expect("a schema"),
            &topic.name,
            &topic.encoding,
            &BTreeMap::new(),
        );
        channels.insert(topic.id, channel.expect("a channel"));
    }
    let schema = writer
        .add_schema("test_msgs/msg/WheelLoads", "ros2msg", DEFINITION.as_bytes())
        .expect("a schema");
    let own = writer
        .add_channel(schema, LOADS, "cdr", &BTreeMap::new())
        .expect("a channel");
    let mut rest = loads.iter().peekable();
    let mut write = |channel_id: u16, time_ns: i64, data: &[u8]| {
        let header = MessageHeader {
            channel_id,
            sequence: 0,
            log_time: time_ns as u64,
            publish_time: time_ns as u64,
        };
        writer
            .write_to_known_channel(&header, data)
            .expect("written");
    };
    let ids: Vec<TopicId> = channels.keys().copied().collect();
    log.read(&ids, &mut |message| {
        while let Some((time_ns, loads)) = rest.next_if(|(time, _)| *time <= message.log_time_ns) {
            write(own, *time_ns, &encoded(*time_ns, loads));
        }
        write(channels[&message.topic], message.log_time_ns, message.data);
        ControlFlow::Continue(())
    })
    .expect("a log that can be read");
    writer.finish().expect("a finished file");
}

fn encoded(time_ns: i64, loads: &[f64; 4]) -> Vec<u8> {
    let mut bytes = vec![0, 1, 0, 0];
    bytes.extend(((time_ns / 1_000_000_000) as i32).to_le_bytes());
    bytes.extend(((time_ns % 1_000_000_000) as u32).to_le_bytes());
    // an empty name and its end, then up to a multiple of eight
    bytes.extend([1, 0, 0, 0, 0, 0, 0, 0]);
    loads
        .iter()
        .for_each(|load| bytes.extend(load.to_le_bytes()));
    bytes
}
