//! Messages to samples, as the offline path makes them: the machine is bound to a log of the first messages.

use anyhow::{Context, Result, bail};
use tipwatch_binding::{MachineFile, Urdf, bind};
use tipwatch_ingest::{Losses, RawMessage, SampleStream, StreamRefusals, TopicId};
use tipwatch_mechanics::state::Sensor;

use super::clock::{Delays, Stamps};
use crate::bridge::input::{Arrival, Lane, LaneId};
use crate::replay::session_of;
use crate::wire::session::Session;

/// Fewest samples of a sensor among the first messages.
const LEAST_SAMPLES: usize = 3;

/// Turns messages into samples.
pub struct Assembly {
    /// The session to announce. Its identity is not set.
    pub session: Session,
    /// Notes for the user: which topic is which sensor, and on which clock.
    pub notes: Vec<String>,
    stream: SampleStream,
    /// The topic of each lane; `None` for lanes that are not in the log of the first messages.
    topics: Vec<Option<TopicId>>,
    /// Sensor of each request, and the offset that is added to its stamps (ns).
    sensors: Vec<(Sensor, i64)>,
}

impl Assembly {
    /// Binds the machine to the first messages.
    ///
    /// # Errors
    /// A sensor is missing among them or too rare, or the machine does not match them.
    pub fn of(
        file: &MachineFile,
        urdf: &Urdf,
        lanes: &[Lane],
        first: &[Arrival],
        stamps: Stamps,
        unix_ahead_ns: i64,
    ) -> Result<Self> {
        let folder = tempfile::tempdir().context("a folder for the first messages")?;
        let path = folder.path().join("first messages.mcap");
        write_log(&path, lanes, first).context("the first messages")?;
        let log = file.open_log(&path)?;
        let bound = bind(&log, &file.spec, &urdf.text, &urdf.name)?;
        let mut session = session_of(&bound, file, urdf)?;
        // an error that every reader would meet is reported here
        session.machine(file, urdf)?;
        let requests: Vec<_> = bound.all().map(|b| b.request.clone()).collect();
        let mut stream = SampleStream::new(&log, &requests)?;
        let name = |topic: TopicId| log.topics()[topic.index()].name.clone();
        if let Some((topic, finding)) = stream.refusal() {
            bail!("{}: {}: {}", name(topic), finding.seen, finding.done);
        }
        let mut notes = Vec::new();
        for clock in stream.clocks() {
            if clock.samples < LEAST_SAMPLES {
                bail!(
                    "{}: expected at least {LEAST_SAMPLES} messages to begin with, found {}",
                    name(clock.topic),
                    clock.samples
                );
            }
            for finding in &clock.findings {
                notes.push(format!(
                    "{}: {}: {}",
                    name(clock.topic),
                    finding.seen,
                    finding.done
                ));
            }
        }
        for sensor in bound.all() {
            let topic = name(sensor.request.topic);
            notes.push(format!("{:?}: {topic} ({})", sensor.sensor, sensor.why));
        }
        notes.extend(bound.notes.iter().cloned());
        let sensors = bound.all().map(|sensor| {
            let offset_s = bound.clock_offsets_s.get(&name(sensor.request.topic));
            let shift_ns = (offset_s.copied().unwrap_or(0.0) * 1e9).round() as i64;
            (sensor.sensor, shift_ns)
        });
        let sensors: Vec<(Sensor, i64)> = sensors.collect();
        let of_log = |lane: &Lane| {
            let mut topics = log.topics().iter();
            let found = topics.find(|t| t.name == lane.name && t.type_name == lane.type_name);
            found.map(|topic| topic.id)
        };
        let topics: Vec<Option<TopicId>> = lanes.iter().map(of_log).collect();
        let mut delays = Delays::default();
        for arrival in first {
            let Some(message) = raw(&topics, arrival) else {
                continue;
            };
            stream.take(&message, &mut |request, stamp_ns, _| {
                let shift_ns = sensors.get(request).map_or(0, |(_, shift)| *shift);
                delays.add(stamp_ns.saturating_add(shift_ns), arrival.host_ns);
            });
        }
        let (clock, told) = delays.clock(stamps, unix_ahead_ns);
        session.clock = clock;
        notes.push(told);
        Ok(Self {
            session,
            notes,
            stream,
            topics,
            sensors,
        })
    }

    /// Passes every sample that is complete with a message to `each`: its sensor, its time of measurement (ns) and its
    /// values. `None` for a message of a topic that is not used.
    pub fn take(
        &mut self,
        arrival: &Arrival,
        each: &mut dyn FnMut(Sensor, i64, &[f64]),
    ) -> Option<StreamRefusals> {
        let message = raw(&self.topics, arrival)?;
        let sensors = &self.sensors;
        Some(
            self.stream
                .take(&message, &mut |request, stamp_ns, values| {
                    if let Some((sensor, shift_ns)) = sensors.get(request) {
                        each(*sensor, stamp_ns.saturating_add(*shift_ns), values);
                    }
                }),
        )
    }

    /// Whether the messages of a lane are used.
    #[must_use]
    pub fn knows(&self, lane: LaneId) -> bool {
        self.topics.get(lane.0).is_some_and(Option::is_some)
    }

    /// Checks that no CAN message has two senders.
    ///
    /// # Errors
    /// One has, and the machine file does not say which is meant.
    pub fn check_can(&self) -> Result<()> {
        Ok(self.stream.check_can(&mut Losses::default())?)
    }
}

impl std::fmt::Debug for Assembly {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Assembly")
            .field("session", &self.session)
            .field("sensors", &self.sensors)
            .finish_non_exhaustive()
    }
}

fn raw<'a>(topics: &[Option<TopicId>], arrival: &'a Arrival) -> Option<RawMessage<'a>> {
    let topic = (*topics.get(arrival.lane.0)?)?;
    Some(RawMessage {
        topic,
        log_time_ns: arrival.log_ns,
        publish_time_ns: arrival.sent_ns.unwrap_or(arrival.log_ns),
        sequence: 0,
        writer: 0,
        data: &arrival.data,
    })
}

/// Writes messages as a log.
fn write_log(path: &std::path::Path, lanes: &[Lane], messages: &[Arrival]) -> Result<()> {
    let options = mcap::WriteOptions::new().profile("ros2").compression(None);
    let file = std::io::BufWriter::new(std::fs::File::create_new(path)?);
    let mut writer = options.create(file)?;
    let mut channels = Vec::new();
    for lane in lanes {
        let schema = writer.add_schema(&lane.type_name, "ros2msg", lane.definition.as_bytes())?;
        channels.push(writer.add_channel(
            schema,
            &lane.name,
            "cdr",
            &std::collections::BTreeMap::new(),
        )?);
    }
    for (sequence, message) in (0_u32..).zip(messages) {
        let Some(&channel_id) = channels.get(message.lane.0) else {
            continue;
        };
        let header = mcap::records::MessageHeader {
            channel_id,
            sequence,
            log_time: u64::try_from(message.log_ns).unwrap_or(0),
            publish_time: u64::try_from(message.sent_ns.unwrap_or(message.log_ns)).unwrap_or(0),
        };
        writer.write_to_known_channel(&header, &message.data)?;
    }
    writer.finish()?;
    Ok(())
}
