//! The DBC file of the verdict's frame.

use std::fmt::Write as _;

use tipwatch_can::CanId;
use tipwatch_mechanics::verdict::Level;

use super::can_frame::FIELDS;

/// The text of the DBC file for frames with this identifier.
#[must_use]
pub fn dbc(id: CanId) -> String {
    // bit 31 marks an identifier of 29 bits
    let number = id.raw | u32::from(id.is_extended) << 31;
    let mut text = format!(
        "VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_: Tipwatch\n\nBO_ {number} TipwatchVerdict: 8 Tipwatch\n"
    );
    for field in &FIELDS {
        let sign = if field.is_signed { '-' } else { '+' };
        // writing to a string cannot fail
        let _ = writeln!(
            text,
            " SG_ {} : {}|{}@1{sign} ({},0) [{}|{}] \"{}\" Vector__XXX",
            field.name,
            field.start,
            field.length,
            field.scale,
            field.least,
            field.largest,
            field.unit
        );
    }
    let _ = writeln!(
        text,
        "\nCM_ BO_ {number} \"How close the machine is to tipping over. Sent every 50 ms and at once when the level \
         changes. Act as on a fault if no frame comes for 200 ms, the counter stands still, the checksum is wrong or \
         Valid is 0.\";"
    );
    for field in &FIELDS {
        let _ = writeln!(text, "CM_ SG_ {number} {} \"{}.\";", field.name, field.doc);
    }
    let levels: Vec<String> = Level::ALL
        .into_iter()
        .map(|level| format!("{} \"{}\"", level as u8, level.name()))
        .collect();
    for name in ["Level", "LatchedLevel"] {
        let _ = writeln!(text, "VAL_ {number} {name} {} ;", levels.join(" "));
    }
    for field in FIELDS.iter().filter(|field| field.absent.is_some()) {
        let absent = field.absent.unwrap_or_default();
        let _ = writeln!(
            text,
            "VAL_ {number} {} {absent} \"not available\" ;",
            field.name
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use tipwatch_can::{Database, Decoder, Selection};

    use super::*;
    use crate::bridge::output::{CanVerdict, View, crc8};
    use crate::wire::names::Names;
    use crate::wire::topics::WireVerdict;

    fn decoded(id: CanId, view: &View<'_>) -> Vec<(String, f64)> {
        let database = Database::parse(dbc(id).as_bytes()).unwrap();
        let message = database.message("TipwatchVerdict").unwrap().clone();
        let names: Vec<String> = message.signals.iter().map(|s| s.name.clone()).collect();
        let frame = CanVerdict::new(id).frame(view);
        assert_eq!(frame.data()[7], crc8(&frame.data()[..7]));
        let mut found = Vec::new();
        Decoder::new(vec![Selection::of(message)]).decode(&frame, &mut |_, values| {
            found = names.iter().cloned().zip(values.iter().copied()).collect();
        });
        found
    }

    fn value(of: &[(String, f64)], name: &str) -> f64 {
        of.iter().find(|(known, _)| known == name).unwrap().1
    }

    #[test]
    fn a_frame_reads_back_by_its_own_dbc_file() {
        let mut verdict = WireVerdict::unknown();
        (verdict.level, verdict.latched_level) = (3, 4);
        verdict.wheel_count = 4;
        verdict.otf[..4].copy_from_slice(&[9000.0, -1234.0, 8000.0, 7000.0]);
        verdict.utilisation = 1.0421;
        verdict.time_to_lift_off_s = 0.519;
        let names = Names::default();
        let view = View {
            verdict: Some(&verdict),
            names: &names,
            now_ns: 0,
        };
        for id in [CanId::extended(0x18ff_70e5), CanId::standard(0x123)] {
            let read = decoded(id, &view);
            assert_eq!(value(&read, "Level"), 3.0);
            assert_eq!(value(&read, "LatchedLevel"), 4.0);
            assert_eq!(value(&read, "Valid"), 1.0);
            assert_eq!(value(&read, "WorstWheel"), 1.0);
            // rounded towards danger
            assert!(
                (value(&read, "Utilisation") - 1.043).abs() < 1e-9,
                "{read:?}"
            );
            assert!((value(&read, "OverturningForce") + 1250.0).abs() < 1e-9);
            assert!((value(&read, "TimeToLiftOff") - 0.5).abs() < 1e-9);
        }
    }

    #[test]
    fn no_verdict_is_an_invalid_fault_and_huge_numbers_stay_at_the_end_of_the_range() {
        let names = Names::default();
        let mut view = View {
            verdict: None,
            names: &names,
            now_ns: 0,
        };
        let id = CanId::extended(0x18ff_70e5);
        let frame = CanVerdict::new(id).frame(&view);
        // fault, fault, not valid; no wheel; no numbers
        assert_eq!(
            frame.data()[..7],
            [0b0010_1101, 0xf0, 0, 0x80, 0, 0x80, 0xff]
        );
        let mut verdict = WireVerdict::unknown();
        verdict.wheel_count = 1;
        verdict.otf[0] = -1e12;
        verdict.utilisation = f64::INFINITY;
        view.verdict = Some(&verdict);
        let read = decoded(id, &view);
        assert_eq!(value(&read, "OverturningForce"), -1_638_350.0);
        assert!((value(&read, "Utilisation") - 32.767).abs() < 1e-9);
        assert_eq!(value(&read, "Level"), 0.0);
    }

    #[test]
    fn the_counter_rises_with_every_frame_and_begins_again_after_fifteen() {
        let names = Names::default();
        let view = View {
            verdict: None,
            names: &names,
            now_ns: 0,
        };
        let mut frames = CanVerdict::new(CanId::standard(1));
        let counters: Vec<u8> = (0..18)
            .map(|_| frames.frame(&view).data()[1] & 15)
            .collect();
        assert_eq!(counters[..3], [0, 1, 2]);
        assert_eq!(counters[15..], [15, 0, 1]);
    }
}
