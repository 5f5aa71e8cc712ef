//! Every format gives the frames that python-can and asammdf wrote.

use tipwatch_can::{ContainerFormat, FrameKind};

use crate::support::{data, frames, listed};

/// 2023-11-14 22:13:20 UTC.
const START_NS: i64 = 1_700_000_000_000_000_000;

/// Checks all frames; the clock of a format counts in steps of `step_ns`.
fn check(name: &str, channels: [&str; 2], step_ns: i64) {
    let (found, lost) = frames(&data(name));
    assert_eq!(lost, [""; 0], "{name}");
    let expected = listed();
    assert_eq!(found.len(), expected.len(), "{name}");
    let first_ns = found[0].1.time_ns;
    assert!(
        (first_ns - START_NS).abs() < 1_000_000_000,
        "{name}: starts at {first_ns}"
    );
    for (place, ((channel, found), expected)) in found.iter().zip(&expected).enumerate() {
        let context = format!("{name}, frame {place}");
        let drift = found.time_ns - first_ns - expected.time_ns;
        assert!(drift.abs() <= step_ns, "{context}: {drift} ns");
        assert_eq!(channel, channels[expected.channel], "{context}");
        assert_eq!(found.kind, expected.kind, "{context}");
        assert_eq!(found.data(), expected.data(), "{context}");
        if found.kind != FrameKind::Error {
            assert_eq!(
                (found.id, found.is_fd),
                (expected.id, expected.is_fd),
                "{context}"
            );
        }
    }
}

#[test]
fn val_candump_text_is_read() {
    check("mixed.log", ["can0", "can1"], 1_000);
}

#[test]
fn val_vector_asc_is_read() {
    check("mixed.asc", ["can1", "can2"], 2_000);
}

#[test]
fn val_vector_blf_is_read() {
    check("mixed.blf", ["can1", "can2"], 1_000);
}

#[test]
fn val_asam_mf4_is_read_compressed_and_not() {
    for name in ["mixed.mf4", "mixed_plain.mf4", "mixed_transposed.mf4"] {
        check(name, ["can0", "can1"], 1_000);
    }
}

#[test]
fn formats_are_seen_in_the_content() {
    let cases = [
        ("mixed.log", Some(ContainerFormat::Candump)),
        ("mixed.asc", Some(ContainerFormat::Asc)),
        ("mixed.blf", Some(ContainerFormat::Blf)),
        ("mixed.mf4", Some(ContainerFormat::Mf4)),
        ("machine.dbc", None),
        ("decoded.csv", None),
        ("frames.txt", None),
    ];
    for (name, expected) in cases {
        assert_eq!(ContainerFormat::of(&data(name)), expected, "{name}");
    }
    assert_eq!(ContainerFormat::of(b""), None);
}

#[test]
fn terminal_output_of_candump_is_read() {
    let text = " (1700000000.500000)  can0  123   [2]  AB CD\n (1700000001.000000)  can0  18FEF100   [8]  00 01 02 03 04 05 06 07\n \
        (1700000001.5)  can0  321  [12]  00 01 02 03 04 05 06 07 08 09 0A 0B\n (1700000002.0)  can0  7FF  [4]  remote request\n";
    let (found, lost) = frames(text.as_bytes());
    assert_eq!(lost, [""; 0]);
    assert_eq!(found.len(), 4);
    assert_eq!(found[0].1.data(), [0xab, 0xcd]);
    assert!(found[1].1.id.is_extended && found[2].1.is_fd);
    assert_eq!(found[3].1.kind, FrameKind::Remote);
}

#[test]
fn decimal_and_relative_asc_files_are_read() {
    let text = "date Sat Sep 30 03:06:13.191 pm 2017\nbase dec  timestamps relative\n// a comment\n\
        0.5 1  291             Rx   d 2 16 255\n0.25 1 Statistic: D 0 R 0 XD 0\n0.25 2  218034209x  Tx  d 1 7\n";
    let (found, lost) = frames(text.as_bytes());
    assert_eq!(lost, [""; 0]);
    let found: Vec<_> = found
        .iter()
        .map(|(channel, f)| (channel.as_str(), f.time_ns, f.id.raw, f.data()))
        .collect();
    let start = 1_506_783_973_191_000_000;
    let expected = [
        ("can1", start + 500_000_000, 0x123, &[16, 255][..]),
        ("can2", start + 1_000_000_000, 0x0cfe_f021, &[7][..]),
    ];
    assert_eq!(found, expected);
}
