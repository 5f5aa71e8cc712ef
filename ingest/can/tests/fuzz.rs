//! No bytes make the readers or the DBC parser panic, or read without end.

use std::io::Cursor;

use tipwatch_can::{Container, ContainerFormat, Database, Decoder, Frame, FrameSource, Selection};

use crate::support::data;

/// Frames as `candump -td -x` prints them.
const CANDUMP_INTERVALS: &[u8] = b" (000.000000)  can0  RX - -  123   [2]  AB CD\n \
    (000.010000)  can0  RX - -  123   [2]  AB CD\n (000.009000)  can1  TX B E  18FEF100   [8]  00 01 02 03 04 05 06 07\n \
    (000.011000)  can0  RX - -  321  [12]  00 01 02 03 04 05 06 07 08 09 0A 0B\n";

fn read(format: ContainerFormat, bytes: &[u8], decoder: &mut Decoder) {
    let Ok(mut source) = Container::open_as(format, Cursor::new(bytes)) else {
        return;
    };
    let mut frame = Frame::default();
    let mut frames = 0_usize;
    while source.next_frame(&mut frame).unwrap_or(false) {
        assert!(frame.channel < source.channels().len());
        decoder.decode(&frame, &mut |_, _| {});
        frames += 1;
        // deflate expands at most a thousand times, and a frame has at least eight bytes
        assert!(
            frames <= 200 * (bytes.len() + 16),
            "{frames} frames in {} bytes",
            bytes.len()
        );
    }
}

fn decoder() -> Decoder {
    let database = Database::parse(&data("machine.dbc")).unwrap();
    Decoder::new(database.messages.into_iter().map(Selection::of).collect())
}

#[test]
fn any_bytes_are_survived_by_all_readers() {
    let formats = [
        ContainerFormat::Candump,
        ContainerFormat::Asc,
        ContainerFormat::Blf,
        ContainerFormat::Trc,
        ContainerFormat::Mf4,
    ];
    let decoder = decoder();
    bolero::check!().with_type::<Vec<u8>>().for_each(|bytes| {
        for format in formats {
            read(format, bytes, &mut decoder.clone());
        }
    });
}

#[test]
fn any_changes_of_files_are_survived() {
    let files = [
        (ContainerFormat::Candump, data("mixed.log")),
        (ContainerFormat::Asc, data("mixed.asc")),
        (ContainerFormat::Blf, data("mixed.blf")),
        (ContainerFormat::Mf4, data("mixed.mf4")),
        (ContainerFormat::Mf4, data("mixed_plain.mf4")),
        (ContainerFormat::Mf4, data("mixed_transposed.mf4")),
        (ContainerFormat::Mf4, data("layout_virtual_bus.mf4")),
        (ContainerFormat::Mf4, data("layout_variable_mixed.mf4")),
        (ContainerFormat::Trc, data("classical.trc")),
        (ContainerFormat::Candump, CANDUMP_INTERVALS.to_vec()),
    ];
    let decoder = decoder();
    bolero::check!()
        .with_type::<(u8, Vec<(u16, u8)>, Option<u16>)>()
        .for_each(|(file, changes, cut)| {
            let (format, bytes) = &files[usize::from(*file) % files.len()];
            let mut bytes = bytes.clone();
            for (at, value) in changes {
                let at = usize::from(*at) % bytes.len();
                bytes[at] = *value;
            }
            if let Some(cut) = cut {
                bytes.truncate(usize::from(*cut));
            }
            read(*format, &bytes, &mut decoder.clone());
        });
}

#[test]
fn any_text_is_survived_by_the_dbc_parser() {
    let text = data("machine.dbc");
    bolero::check!()
        .with_type::<(Vec<(u16, u8)>, u16, Vec<u8>)>()
        .for_each(|(changes, cut, other)| {
            let mut text = text.clone();
            for (at, value) in changes {
                let at = usize::from(*at) % text.len();
                text[at] = *value;
            }
            let end = usize::from(*cut) % text.len();
            for bytes in [&text[..], &text[..end], other] {
                if let Ok(database) = Database::parse(bytes) {
                    let mut decoder =
                        Decoder::new(database.messages.into_iter().map(Selection::of).collect());
                    read(ContainerFormat::Candump, &data("machine.log"), &mut decoder);
                }
            }
        });
}

#[test]
fn numbers_at_their_limits_are_survived_at_every_place() {
    // links and lengths of MF4 files are 64 bits wide, lengths of BLF objects 32
    const LIMITS: [u64; 6] = [
        u64::MAX,
        u64::MAX - 23,
        i64::MAX as u64,
        u64::MAX << 32,
        u32::MAX as u64,
        1 << 40,
    ];
    let files = [
        (ContainerFormat::Blf, data("mixed.blf")),
        (ContainerFormat::Mf4, data("mixed.mf4")),
        (ContainerFormat::Mf4, data("layout_sources.mf4")),
        (ContainerFormat::Mf4, data("layout_most_length.mf4")),
        (ContainerFormat::Mf4, data("layout_variable_mixed.mf4")),
        (ContainerFormat::Mf4, data("layout_variable_sorted.mf4")),
        (ContainerFormat::Mf4, data("layout_virtual_time.mf4")),
    ];
    let decoder = decoder();
    for (format, intact) in &files {
        for at in (0..intact.len() - 8).step_by(4) {
            for limit in LIMITS {
                let mut bytes = intact.clone();
                bytes[at..at + 8].copy_from_slice(&limit.to_le_bytes());
                read(*format, &bytes, &mut decoder.clone());
            }
        }
    }
}
