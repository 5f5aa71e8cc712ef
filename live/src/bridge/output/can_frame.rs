//! The verdict as a CAN frame of eight bytes. The frame and its DBC file come from one table.

use tipwatch_can::{CanId, Frame};
use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::verdict::{Basis, Level};

use super::view::View;

/// A signal of the frame, in Intel byte order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Field {
    pub(super) name: &'static str,
    pub(super) start: u8,
    pub(super) length: u8,
    pub(super) is_signed: bool,
    pub(super) scale: f64,
    pub(super) least: f64,
    pub(super) largest: f64,
    pub(super) unit: &'static str,
    /// The raw number that stands for "not available".
    pub(super) absent: Option<i64>,
    pub(super) doc: &'static str,
}

/// Raw number of "no wheel".
const NO_WHEEL: i64 = 15;
const ABSENT: i64 = -32768;
const NO_LIFT_OFF: i64 = 255;

const LEVEL: Field = field("Level", 0, 3, "Current level");
const LATCHED: Field = field(
    "LatchedLevel",
    3,
    3,
    "Level to act on: danger stays until it is over and acknowledged",
);
const VALID: Field = field(
    "Valid",
    6,
    1,
    "1: a current verdict stands behind this frame; 0: act as on a fault",
);
const PROVEN: Field = field(
    "Proven",
    7,
    1,
    "1: every signal that the loads hang on is proven, and none is doubted; 0: act as if the machine were not known to be safe",
);
const COUNTER: Field = field("Counter", 8, 4, "Rises by 1 with every frame");
const WHEEL: Field = Field {
    absent: Some(NO_WHEEL),
    largest: 14.0,
    ..field(
        "WorstWheel",
        12,
        4,
        "Index of the wheel with the smallest overturning force; 15: unknown",
    )
};
const UTILISATION: Field = Field {
    is_signed: true,
    scale: 0.001,
    least: -32.767,
    largest: 32.767,
    absent: Some(ABSENT),
    ..field(
        "Utilisation",
        16,
        16,
        "Share of the static load that the worst wheel has lost; -32768 raw: unknown",
    )
};
const FORCE: Field = Field {
    is_signed: true,
    scale: 50.0,
    least: -1_638_350.0,
    largest: 1_638_350.0,
    unit: "N",
    absent: Some(ABSENT),
    ..field(
        "OverturningForce",
        32,
        16,
        "Smallest overturning force of all wheels, towards the safe side; -32768 raw: unknown",
    )
};
const LIFT_OFF: Field = Field {
    scale: 0.02,
    largest: 5.08,
    unit: "s",
    absent: Some(NO_LIFT_OFF),
    ..field(
        "TimeToLiftOff",
        48,
        8,
        "Time until the next wheel lifts if its load falls on; 255 raw: none foreseen, or unknown",
    )
};
const CHECKSUM: Field = field("Checksum", 56, 8, "CRC-8 of SAE J1850 over bytes 0 to 6");

/// All signals of the frame.
pub(super) const FIELDS: [Field; 10] = [
    LEVEL,
    LATCHED,
    VALID,
    PROVEN,
    COUNTER,
    WHEEL,
    UTILISATION,
    FORCE,
    LIFT_OFF,
    CHECKSUM,
];

const fn field(name: &'static str, start: u8, length: u8, doc: &'static str) -> Field {
    Field {
        name,
        start,
        length,
        is_signed: false,
        scale: 1.0,
        least: 0.0,
        largest: ((1_u32 << length) - 1) as f64,
        unit: "",
        absent: None,
        doc,
    }
}

/// Direction in which a number between two steps is rounded.
#[derive(Debug, Clone, Copy)]
enum Rounding {
    Down,
    Up,
}

impl Field {
    /// Writes a number: towards the side that `rounding` says, within the range of the signal.
    fn put(&self, data: &mut [u8; 8], number: f64, rounding: Rounding) {
        let raw = match (number.is_nan(), self.absent) {
            (true, Some(absent)) => absent,
            _ => {
                let steps = number.clamp(self.least, self.largest) / self.scale;
                // what is a whole number of steps but for the last bits is that number
                let nearest = steps.round();
                let steps = match rounding {
                    _ if (steps - nearest).abs() < 1e-6 => nearest,
                    Rounding::Down => steps.floor(),
                    Rounding::Up => steps.ceil(),
                };
                steps as i64
            }
        };
        let mask = (1_u64 << self.length) - 1;
        let bits = (raw as u64 & mask) << self.start;
        let whole = u64::from_le_bytes(*data) & !(mask << self.start) | bits;
        *data = whole.to_le_bytes();
    }
}

/// Makes the frames: each with the next counter.
#[derive(Debug, Clone)]
pub struct CanVerdict {
    id: CanId,
    counter: u8,
}

impl CanVerdict {
    /// Frames with this identifier.
    #[must_use]
    pub fn new(id: CanId) -> Self {
        Self { id, counter: 0 }
    }

    /// The frame of a verdict. Numbers between two steps are rounded towards danger.
    pub fn frame(&mut self, view: &View<'_>) -> Frame {
        let mut data = [0; 8];
        let mut put = |field: &Field, number: f64, rounding| field.put(&mut data, number, rounding);
        let level = |level: Level| f64::from(level as u8);
        put(&LEVEL, level(view.momentary()), Rounding::Down);
        put(&LATCHED, level(view.level()), Rounding::Down);
        put(
            &VALID,
            f64::from(u8::from(view.verdict.is_some())),
            Rounding::Down,
        );
        let is_proven = view.basis() == Basis::Proven;
        put(&PROVEN, f64::from(u8::from(is_proven)), Rounding::Down);
        put(&COUNTER, f64::from(self.counter), Rounding::Down);
        let worst = view.worst_wheel();
        let (wheel, force) =
            worst.map_or((f64::NAN, f64::NAN), |(wheel, force)| (wheel as f64, force));
        put(&WHEEL, wheel, Rounding::Down);
        put(
            &UTILISATION,
            view.number(Quantity::Utilisation),
            Rounding::Up,
        );
        put(&FORCE, force, Rounding::Down);
        let in_s = view.time_to_lift_off_s();
        put(
            &LIFT_OFF,
            if in_s > LIFT_OFF.largest {
                f64::NAN
            } else {
                in_s
            },
            Rounding::Down,
        );
        data[7] = crc8(&data[..7]);
        self.counter = (self.counter + 1) % 16;
        let mut frame = Frame::default();
        frame.id = self.id;
        frame.set_data(&data);
        frame
    }
}

/// CRC-8 of SAE J1850: polynomial 0x1D, initial value and final exclusive or 0xFF.
#[must_use]
pub fn crc8(bytes: &[u8]) -> u8 {
    let step = |crc: u8, byte: &u8| {
        (0..8).fold(crc ^ byte, |crc, _| match crc & 0x80 {
            0 => crc << 1,
            _ => crc << 1 ^ 0x1d,
        })
    };
    !bytes.iter().fold(0xff, step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_checksum_of_the_catalogue() {
        // the check value of CRC-8/SAE-J1850
        assert_eq!(crc8(b"123456789"), 0x4b);
    }

    #[test]
    fn signals_do_not_overlap_and_fill_the_frame() {
        let mut seen = 0_u64;
        for field in FIELDS {
            let mask = ((1_u64 << field.length) - 1) << field.start;
            assert_eq!(seen & mask, 0, "{}", field.name);
            seen |= mask;
        }
        assert_eq!(seen, u64::MAX);
    }
}
