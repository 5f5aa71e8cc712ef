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
            field.name, field.start, field.length, field.scale, field.least, field.largest, field.unit
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
        let _ = writeln!(text, "VAL_ {number} {} {absent} \"not available\" ;", field.name);
    }
    text
}
