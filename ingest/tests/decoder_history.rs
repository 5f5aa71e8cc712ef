use tipwatch_ingest::{RawMessage, SensorDecoder, SensorKind, SensorSample, Topic};

use crate::support::{Cdr, TempLog};

/// Pseudo-random numbers.
struct Random(u64);

impl Random {
    fn below(&mut self, end: u64) -> u64 {
        self.0 = (self.0.wrapping_mul(6_364_136_223_846_793_005))
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % end
    }

    fn number(&mut self) -> f64 {
        match self.below(8) {
            0 => 0.0,
            1 => -1.0,
            _ => self.below(1000) as f64 * 0.37 - 100.0,
        }
    }

    fn numbers(&mut self, count: u64) -> Vec<f64> {
        (0..count).map(|_| self.number()).collect()
    }

    fn one_of<'a>(&mut self, texts: &[&'a str]) -> &'a str {
        texts[self.below(texts.len() as u64) as usize]
    }

    /// A message of the kind, in one of a few shapes that come again and again.
    fn message(&mut self, kind: SensorKind) -> Vec<u8> {
        let mut cdr = Cdr::new(self.below(10) == 0);
        let stamp_ns = self.below(3) as i64 * 1_000_000_007;
        let frame = self.one_of(&["base", "base", "base", "base", "base", "base", "arm", ""]);
        cdr.header(stamp_ns, frame);
        match kind {
            SensorKind::JointStates => {
                let names: &[&str] = match self.below(8) {
                    0 => &["slew", "boom"],
                    1 => &["boom"],
                    2 => &["grip", "slew", "a", "boom"],
                    _ => &["boom", "slew"],
                };
                let count = names.len() as u64;
                let (positions, rates) = (self.numbers(count), self.numbers(count));
                let lacks_rates = self.below(6) == 0;
                cdr.texts(names).numbers(&positions);
                cdr.numbers(if lacks_rates { &[] } else { &rates });
                cdr.numbers(&[]);
            }
            SensorKind::Imu => {
                let all = self.numbers(4 + 9 + 3 + 9 + 3 + 9);
                let zeros = [0.0; 4];
                cdr.all(if self.below(5) == 0 {
                    &zeros
                } else {
                    &all[..4]
                });
                cdr.all(&all[4..]);
            }
            SensorKind::Odometry => {
                cdr.text(self.one_of(&["wheels", "wheels", "w"]));
                cdr.all(&self.numbers(7 + 36 + 6 + 36));
            }
            _ => {
                cdr.all(&self.numbers(6));
            }
        }
        let mut bytes = cdr.bytes;
        let place = self.below(bytes.len() as u64) as usize;
        match self.below(12) {
            0 => bytes[place] ^= 1 << self.below(8),
            1 => bytes.truncate(place),
            2 => bytes.extend([0; 8]),
            _ => {}
        }
        bytes
    }
}

fn topic(kind: SensorKind) -> Topic {
    let folder: TempLog = crate::rosbag2::database(&[("/t", kind.type_name())], &[], false);
    tipwatch_ingest::Log::open(&folder.path).unwrap().topics()[0].clone()
}

fn decoded(decoder: &mut SensorDecoder, topic: &Topic, data: &[u8]) -> String {
    let mut sample = SensorSample::default();
    let message = RawMessage {
        topic: topic.id,
        log_time_ns: 2,
        publish_time_ns: 1,
        sequence: 0,
        writer: 0,
        data,
    };
    let result = decoder.decode(&message, &mut sample);
    let bits: Vec<u64> = sample.values.iter().map(|value| value.to_bits()).collect();
    format!("{result:?} {:?} {bits:x?}", sample.header_stamp_ns)
}

#[test]
fn a_message_is_decoded_alike_whatever_came_before() {
    let joints = ["boom", "slew"].map(str::to_owned);
    for kind in [
        SensorKind::JointStates,
        SensorKind::Imu,
        SensorKind::Odometry,
        SensorKind::ToolWrench,
    ] {
        let topic = topic(kind);
        let new = SensorDecoder::new(&topic, kind, &joints).unwrap();
        let mut compared = 0;
        for seed in 0..20 {
            let mut random = Random(seed);
            let mut decoder = new.clone();
            for _ in 0..400 {
                let message = random.message(kind);
                let alone = decoded(&mut new.clone(), &topic, &message);
                let then = decoded(&mut decoder, &topic, &message);
                // of another sensor than the first message
                if kind != SensorKind::JointStates && then.starts_with("Err(OtherFrame)") {
                    continue;
                }
                compared += 1;
                assert_eq!(then, alone, "{kind:?}, seed {seed}, {message:02x?}");
            }
        }
        assert!(compared > 20 * 100, "{kind:?}: {compared}");
    }
}
