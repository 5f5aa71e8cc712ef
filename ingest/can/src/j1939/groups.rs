//! Public parameter groups that need no DBC file.
//!
//! Layouts, scales and offsets are those of SAE J1939-71 as the manuals of inertial sensors (Aceinna OpenIMU,
//! Axiomatic, ifm) and of axle load systems print them. Parameters whose scale is not stated alike there are left out.

use crate::{
    bits::BitRange,
    message::{Addressing, Message, Multiplexed, Protocol, Signal, ValueKind},
    unit::SiUnit,
};

/// A parameter: name, start bit, length in bits, factor and offset, unit.
type Parameter = (&'static str, usize, u32, (f64, f64), &'static str);
type Group = (u32, &'static str, &'static [Parameter]);

const KM_H: (f64, f64) = (1.0 / 256.0, 0.0);
/// Scale and offset of the relative wheel speeds: 1/16 km/h, from -7.8125 km/h on.
const WHEEL: (f64, f64) = (1.0 / 16.0, -7.8125);
const ANGLE: (f64, f64) = (1.0 / 32768.0, -250.0);
const RATE: (f64, f64) = (1.0 / 128.0, -250.0);
const SLOPE: (f64, f64) = (0.002, -64.0);
const ACCELERATION: (f64, f64) = (0.01, -320.0);

const GROUPS: &[Group] = &[
    (
        61449,
        "VehicleDynamicStabilityControl2",
        &[
            (
                "steering_wheel_angle",
                0,
                16,
                (1.0 / 1024.0, -31.374),
                "rad",
            ),
            ("yaw_rate", 24, 16, (1.0 / 8192.0, -3.92), "rad/s"),
            (
                "lateral_acceleration",
                40,
                16,
                (1.0 / 2048.0, -15.687),
                "m/s2",
            ),
            ("longitudinal_acceleration", 56, 8, (0.1, -12.5), "m/s2"),
        ],
    ),
    (
        61459,
        "SlopeSensorInformation",
        &[
            ("pitch_angle", 0, 16, SLOPE, "deg"),
            ("roll_angle", 16, 16, SLOPE, "deg"),
            ("pitch_rate", 32, 16, SLOPE, "deg/s"),
        ],
    ),
    (
        61481,
        "SlopeSensorInformation2",
        &[
            ("pitch_angle", 0, 24, ANGLE, "deg"),
            ("roll_angle", 24, 24, ANGLE, "deg"),
        ],
    ),
    (
        61482,
        "AngularRateInformation",
        &[
            ("pitch_rate", 0, 16, RATE, "deg/s"),
            ("roll_rate", 16, 16, RATE, "deg/s"),
            ("yaw_rate", 32, 16, RATE, "deg/s"),
        ],
    ),
    (
        61485,
        "AccelerationSensor",
        &[
            ("lateral_acceleration", 0, 16, ACCELERATION, "m/s2"),
            ("longitudinal_acceleration", 16, 16, ACCELERATION, "m/s2"),
            ("vertical_acceleration", 32, 16, ACCELERATION, "m/s2"),
        ],
    ),
    (
        65132,
        "Tachograph",
        &[("vehicle_speed", 48, 16, KM_H, "km/h")],
    ),
    (
        65134,
        "HighResolutionWheelSpeed",
        &[
            ("front_left_wheel_speed", 0, 16, KM_H, "km/h"),
            ("front_right_wheel_speed", 16, 16, KM_H, "km/h"),
            ("rear_left_wheel_speed", 32, 16, KM_H, "km/h"),
            ("rear_right_wheel_speed", 48, 16, KM_H, "km/h"),
        ],
    ),
    (
        65136,
        "CombinationVehicleWeight",
        &[
            ("powered_vehicle_weight", 0, 16, (10.0, 0.0), "kg"),
            ("gross_combination_weight", 16, 16, (10.0, 0.0), "kg"),
        ],
    ),
    (
        65215,
        "WheelSpeedInformation",
        &[
            ("front_axle_speed", 0, 16, KM_H, "km/h"),
            ("front_left_relative_speed", 16, 8, WHEEL, "km/h"),
            ("front_right_relative_speed", 24, 8, WHEEL, "km/h"),
            ("rear_1_left_relative_speed", 32, 8, WHEEL, "km/h"),
            ("rear_1_right_relative_speed", 40, 8, WHEEL, "km/h"),
            ("rear_2_left_relative_speed", 48, 8, WHEEL, "km/h"),
            ("rear_2_right_relative_speed", 56, 8, WHEEL, "km/h"),
        ],
    ),
    (VEHICLE_WEIGHT, "VehicleWeight", &[]),
    (
        65265,
        "CruiseControlVehicleSpeed",
        &[("wheel_based_vehicle_speed", 8, 16, KM_H, "km/h")],
    ),
];

const VEHICLE_WEIGHT: u32 = 65258;
/// Axles that the location of a weight can distinguish: 15 means "not available".
const AXLES: u64 = 15;

/// A parameter group by its number; `None` if a DBC file is needed.
#[must_use]
pub fn public_group(pgn: u32) -> Option<Message> {
    let (pgn, name, parameters) = GROUPS.iter().find(|group| group.0 == pgn)?;
    let mut signals: Vec<Signal> = parameters.iter().filter_map(signal).collect();
    if *pgn == VEHICLE_WEIGHT {
        signals = axle_weights();
    }
    Some(Message {
        name: (*name).to_owned(),
        symbol: None,
        addressing: Addressing::ParameterGroup {
            pgn: *pgn,
            source: None,
        },
        len: 8,
        protocol: Protocol::J1939,
        signals,
    })
}

/// All parameter groups that need no DBC file.
pub fn public_groups() -> impl Iterator<Item = Message> {
    GROUPS.iter().filter_map(|group| public_group(group.0))
}

fn signal(parameter: &Parameter) -> Option<Signal> {
    let &(name, start, bit_count, (factor, offset), unit) = parameter;
    let si = SiUnit::of(unit)?;
    Some(Signal {
        name: name.to_owned(),
        symbol: None,
        bits: BitRange::little_endian(start, bit_count)?,
        kind: ValueKind::Unsigned,
        factor,
        offset,
        range: None,
        unit: unit.to_owned(),
        si,
        is_converted: true,
        not_numbers: Vec::new(),
        multiplexed: None,
        is_multiplexer: false,
        is_counter: false,
        is_checksum: false,
    })
}

/// Vehicle weight: the high four bits of the first byte are the number of the axle, from the front on. The low four bits
/// number positions on the axle from the left on; a weight of a single position is not that of an axle, so that only
/// position 0 and "not available" are read.
fn axle_weights() -> Vec<Signal> {
    let location = ("axle_location", 0, 8, (1.0, 0.0), "");
    let mut signals: Vec<Signal> = signal(&location).into_iter().collect();
    for location in &mut signals {
        location.is_multiplexer = true;
    }
    for axle in 0..AXLES {
        let weight = signal(&("axle_weight", 8, 16, (0.5, 0.0), "kg"));
        signals.extend(weight.map(|weight| Signal {
            name: format!("axle_{}_weight", axle + 1),
            multiplexed: Some(Multiplexed {
                multiplexer: 0,
                values: vec![axle << 4..=axle << 4, axle << 4 | 15..=axle << 4 | 15],
            }),
            ..weight
        }));
    }
    for (name, start) in [("trailer_weight", 24), ("cargo_weight", 40)] {
        signals.extend(signal(&(name, start, 16, (2.0, 0.0), "kg")));
    }
    signals
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tally::Tally;

    fn decoded(pgn: u32, data: &[u8]) -> Vec<(String, f64)> {
        let message = public_group(pgn).unwrap();
        let mut values = Vec::new();
        message.decode(data, &mut values, &mut Tally::default());
        let names = message.signals.iter().map(|signal| signal.name.clone());
        names
            .zip(values)
            .filter(|(_, value)| value.is_finite())
            .collect()
    }

    #[test]
    fn val_slopes_and_rates_are_those_of_the_manuals() {
        // zero of every sensor: half of the range
        let level = (250.0 * 32768.0) as u32;
        let [a, b, c, _] = level.to_le_bytes();
        let angles = decoded(61481, &[a, b, c, a, b, c, 0xff, 0xff]);
        assert!(angles.iter().all(|(_, angle)| angle.abs() < 1e-12) && angles.len() == 2);
        let rates = decoded(61482, &[0x80, 0x7d, 0x00, 0x7d, 0x00, 0xff, 0xff, 5]);
        assert_eq!(rates[0].0, "pitch_rate");
        assert!((rates[0].1.to_degrees() - 1.0).abs() < 1e-9);
        // the last says "not available"
        assert_eq!(rates.len(), 2);
        let forces = decoded(61485, &[0, 0x7d, 0x64, 0x7d, 0xd5, 0x80, 0xff, 0xff]);
        assert!(forces[0].1.abs() < 1e-9 && (forces[1].1 - 1.0).abs() < 1e-9);
        assert!((forces[2].1 - 9.81).abs() < 1e-9);
    }

    #[test]
    fn val_weights_belong_to_the_axle_of_their_location() {
        let weight = decoded(65258, &[0x1f, 0x10, 0x27, 0xff, 0xff, 0xff, 0xff, 0xff]);
        assert_eq!(
            weight,
            [
                ("axle_location".to_owned(), 31.0),
                ("axle_2_weight".to_owned(), 5000.0)
            ]
        );
        let speed = decoded(65265, &[0xff, 0x00, 0x24, 0xff, 0xff, 0xff, 0xff, 0xff]);
        assert_eq!(speed, [("wheel_based_vehicle_speed".to_owned(), 10.0)]);
        // 256 counts are 1 km/h; the second says "not available", the third "error"
        let wheels = decoded(65134, &[0x00, 0x24, 0xff, 0xff, 0x00, 0xfe, 0x00, 0x12]);
        assert_eq!(
            wheels,
            [
                ("front_left_wheel_speed".to_owned(), 10.0),
                ("rear_right_wheel_speed".to_owned(), 5.0)
            ]
        );
    }
}
