//! A machine with an active suspension that stands still: its session, samples and verdicts, for tests of the control.

use std::sync::OnceLock;

use tipwatch_live::safety_limits::VALIDITY_NS;
use tipwatch_live::wire::command::Mode;
use tipwatch_live::wire::session::{Session, StampClock, machine_hash};
use tipwatch_live::wire::topics::{Head, Kind, Wire, WireCommand, WireSample, WireVerdict};
use tipwatch_mechanics::Machine;
use tipwatch_mechanics::state::Sensors;
use tipwatch_mechanics::verdict::{Basis, Level};

use super::feed::{machine, samples};

/// Beginning of the session (ns).
pub const START: i64 = 1_000_000_000_000;
pub const SESSION: u64 = 7;
/// Fastest motion of a rod with its valve all the way open (m/s).
pub const FASTEST: f64 = 0.13;
/// Samples of the IMU that are used, one after the other: noise is part of a sensor that works.
const IMU_SAMPLES: usize = 40;

pub struct Standing {
    pub machine: Machine,
    pub sensors: Sensors,
    pub session: Session,
    /// Samples of the log, without heads.
    samples: Vec<WireSample>,
    /// Places of the suspension's rods in the positions of joints.
    pub rods: [usize; 2],
}

pub fn standing() -> &'static Standing {
    static STANDING: OnceLock<Standing> = OnceLock::new();
    STANDING.get_or_init(|| {
        let (file, urdf) = machine("second_paper");
        let (recording, samples) = samples("second_paper");
        let session = Session {
            id: SESSION,
            machine_hash: machine_hash(&file, &urdf),
            pace: 1.0,
            clock: StampClock {
                stamp_ns: samples[0].time_ns,
                host_ns: START,
            },
            wants_progress: false,
            ..recording.session
        };
        let (machine, sensors) = session.machine(&file, &urdf).unwrap();
        let joints = &session.streams[0];
        let place = |name: &str| joints.iter().position(|joint| joint == name).unwrap();
        Standing {
            rods: ["suspension_right", "suspension_left"].map(place),
            machine,
            sensors,
            session,
            samples,
        }
    })
}

impl Standing {
    /// A sample of this kind without head, with the rods where they are now.
    pub fn sample(&self, kind: Kind, number: usize, rods: [f64; 2]) -> WireSample {
        let mut of_kind = (self.samples.iter()).filter(|sample| sample.kind == kind as u32);
        let place = if kind == Kind::Imu {
            number % IMU_SAMPLES
        } else {
            0
        };
        let mut wire = *of_kind.nth(place).unwrap();
        if kind == Kind::Joints {
            let joints = wire.value_count as usize / 2;
            wire.values[joints..2 * joints].fill(0.0);
            for (rod, place) in rods.into_iter().zip(self.rods) {
                wire.values[place] = rod;
            }
        }
        wire
    }
}

/// Seals a sample of this session, measured and published now.
pub fn seal_sample(wire: &mut WireSample, session: u64, sequence: u64, now_ns: i64) {
    let standing = &standing().session;
    wire.seal(Head {
        sequence,
        source: session,
        machine_hash: standing.machine_hash,
        time_ns: standing.clock.stamp_ns + now_ns - START,
        published_ns: now_ns,
    });
}

/// Moves rods with these openings of their valves for a time, `obedience` times as fast as the valves ask for.
pub fn move_rods(rods: &mut [f64; 2], command: &WireCommand, obedience: f64, time_ns: i64) {
    let reach = FASTEST * obedience * time_ns as f64 * 1e-9;
    for (rod, opening) in rods.iter_mut().zip(command.opening) {
        *rod += reach * opening;
    }
}

/// Whether the valves follow, each open by more than `opening` to either side.
pub fn follows(command: &WireCommand, opening: f64) -> bool {
    let mut openings = command.opening.iter();
    command.mode() == Mode::Follow && openings.all(|found| found.abs() > opening)
}

/// A verdict of this level on the session, valid from now.
pub fn verdict(level: Level, now_ns: i64) -> WireVerdict {
    let mut wire = WireVerdict {
        session: SESSION,
        level: level as u32,
        latched_level: level as u32,
        basis: Basis::Proven as u32,
        valid_until_ns: now_ns + VALIDITY_NS,
        ..WireVerdict::unknown()
    };
    seal_verdict(&mut wire, standing().session.machine_hash);
    wire
}

pub fn seal_verdict(wire: &mut WireVerdict, machine_hash: u64) {
    wire.seal(Head {
        sequence: 5,
        source: 99,
        machine_hash,
        time_ns: 0,
        published_ns: 0,
    });
}
