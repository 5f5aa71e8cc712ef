//! Messages from a pipe, as a stream of MCAP: any program that reads another network can feed the bridge. The stream
//! brings the definitions of its types.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Read};

use anyhow::{Context, Result, bail};
use mcap::records::{Channel, Record};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use tipwatch_ingest::known_definition;

use super::queue::{Arrival, Intake, Lane, LaneId};
use super::wanted::Wanted;
use crate::system::clock::monotonic_ns;

/// Far above any record that carries a sensor.
const MOST_BYTES: usize = 16 << 20;

/// Starts a thread that reads standard input.
///
/// # Errors
/// The thread cannot be started.
pub fn start_mcap(wanted: Wanted, intake: Intake) -> Result<()> {
    std::thread::Builder::new()
        .name("mcap".into())
        .spawn(
            move || match read_mcap(&mut io::stdin(), &wanted, &intake) {
                Ok(()) => intake.teller.say("standard input has ended"),
                Err(error) => intake.teller.say(&format!("standard input: {error:#}")),
            },
        )?;
    Ok(())
}

/// Reads a stream of MCAP into the queue. Each channel is a publisher; sequence numbers other than zero are its counter.
///
/// # Errors
/// The stream cannot be read, or is no MCAP.
pub fn read_mcap(source: &mut dyn Read, wanted: &Wanted, intake: &Intake) -> Result<()> {
    let options = LinearReaderOptions::default().with_record_length_limit(MOST_BYTES);
    let mut reader = LinearReader::new_with_options(options);
    let mut topics = Topics::default();
    while let Some(event) = reader.next_event() {
        match event.context("expected a stream of MCAP")? {
            LinearReadEvent::ReadRequest(count) => {
                let read = match source.read(reader.insert(count)) {
                    Err(error) if error.kind() == io::ErrorKind::Interrupted => 0,
                    Ok(0) if count > 0 => return Ok(()),
                    read => read?,
                };
                reader.notify_read(read);
            }
            LinearReadEvent::Record { data, opcode } => {
                let record = mcap::parse_record(opcode, data).context("a record of the stream")?;
                if !topics.take(record, wanted, intake)? {
                    return Ok(());
                }
            }
        }
    }
    Ok(())
}

#[derive(Default)]
struct Topics {
    /// Name and text of each definition.
    schemas: BTreeMap<u16, (String, String)>,
    lanes: BTreeMap<u16, LaneId>,
    refused: BTreeSet<u16>,
}

impl Topics {
    /// Takes a record; `false` when nobody reads messages any more.
    fn take(&mut self, record: Record<'_>, wanted: &Wanted, intake: &Intake) -> Result<bool> {
        match record {
            Record::Schema { header, data } => {
                let text = String::from_utf8_lossy(&data).into_owned();
                self.schemas.insert(header.id, (header.name, text));
            }
            Record::Channel(channel) => self.channel(&channel, wanted, intake)?,
            Record::Message { header, data } => {
                let Some(&lane) = self.lanes.get(&header.channel_id) else {
                    return Ok(true);
                };
                return Ok(intake.offer(Arrival {
                    lane,
                    host_ns: monotonic_ns(),
                    log_ns: i64::try_from(header.log_time).unwrap_or(0),
                    sent_ns: i64::try_from(header.publish_time).ok(),
                    publisher: u128::from(header.channel_id) + 1,
                    sequence: Some(u64::from(header.sequence)).filter(|&sequence| sequence > 0),
                    missed: 0,
                    data: data.into_owned(),
                }));
            }
            _ => {}
        }
        Ok(true)
    }

    fn channel(&mut self, channel: &Channel, wanted: &Wanted, intake: &Intake) -> Result<()> {
        let Some((type_name, text)) = self.schemas.get(&channel.schema_id) else {
            bail!(
                "{}: expected a definition of its type before it, found none",
                channel.topic
            );
        };
        if self.lanes.contains_key(&channel.id) || !wanted.wants(&channel.topic, type_name) {
            return Ok(());
        }
        if let Some(expected) = wanted.expected_type(&channel.topic, type_name) {
            let text = format!(
                "{}: expected messages of {expected}, found {type_name}: not used",
                channel.topic
            );
            intake
                .teller
                .fault(&format!("type {}", channel.topic), &text);
            return Ok(());
        }
        let definition = match text.trim().is_empty() {
            true => known_definition(type_name),
            false => Some(text.clone()),
        };
        let Some(definition) = definition.filter(|_| channel.message_encoding == "cdr") else {
            if self.refused.insert(channel.id) {
                intake.teller.say(&format!(
                    "{}: expected messages in CDR with their definition, found {type_name} in \"{}\"",
                    channel.topic, channel.message_encoding
                ));
            }
            return Ok(());
        };
        let lane = intake.lane(&Lane {
            name: channel.topic.clone(),
            type_name: type_name.clone(),
            definition,
            is_bus: type_name.ends_with("Frame"),
        });
        self.lanes.insert(channel.id, lane);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::bridge::input::Teller;

    fn stream(messages: u32) -> Vec<u8> {
        let options = mcap::WriteOptions::new().use_chunks(false);
        let mut writer = options.create(io::Cursor::new(Vec::new())).unwrap();
        let schema = writer
            .add_schema("sensor_msgs/msg/Imu", "ros2msg", b"")
            .unwrap();
        let none = BTreeMap::new();
        let wanted = writer
            .add_channel(schema, "/imu/data", "cdr", &none)
            .unwrap();
        let other = writer.add_channel(schema, "/other", "cdr", &none).unwrap();
        for sequence in 1..=messages {
            for channel_id in [wanted, other] {
                let header = mcap::records::MessageHeader {
                    channel_id,
                    sequence,
                    log_time: u64::from(sequence),
                    publish_time: u64::from(sequence),
                };
                writer
                    .write_to_known_channel(&header, &[0, 1, 0, 0, 7])
                    .unwrap();
            }
        }
        writer.finish().unwrap();
        writer.into_inner().into_inner()
    }

    #[test]
    fn a_stream_that_is_cut_anywhere_gives_what_came_before() {
        let bytes = stream(20);
        let wanted = Wanted {
            names: ["/imu/data".to_owned()].into(),
            ..Wanted::default()
        };
        let mut most = 0;
        for end in (0..=bytes.len()).rev().step_by(7) {
            let (intake, arrivals) = Intake::new(Teller::default());
            let _ = read_mcap(&mut &bytes[..end], &wanted, &intake);
            drop(intake);
            let mut count = 0;
            while let Ok(arrival) = arrivals.next(Duration::ZERO) {
                count += 1;
                assert_eq!(arrival.sequence, Some(count));
                assert_eq!(arrival.data, [0, 1, 0, 0, 7]);
            }
            most = most.max(count);
            assert!(arrivals.lanes().len() <= 1);
        }
        assert_eq!(most, 20);
    }

    #[test]
    fn what_is_no_mcap_is_refused() {
        let (intake, _arrivals) = Intake::new(Teller::default());
        let error = read_mcap(
            &mut &b"(10.0) can0 123#00\n"[..],
            &Wanted::default(),
            &intake,
        );
        assert!(format!("{:#}", error.unwrap_err()).contains("expected a stream of MCAP"));
    }
}
