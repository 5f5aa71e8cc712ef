//! Damaged files give what is intact and tell what was lost.

use std::io::Cursor;

use tipwatch_can::{Container, ContainerFormat, Frame, FrameSource};

use crate::support::{data, frames};

const FILES: [&str; 9] = [
    "mixed.log",
    "mixed.asc",
    "mixed.blf",
    "mixed.mf4",
    "mixed_plain.mf4",
    "mixed_transposed.mf4",
    "layout_virtual_bus.mf4",
    "layout_variable_mixed.mf4",
    "classical.trc",
];

#[test]
fn a_damaged_line_costs_one_frame() {
    for name in ["mixed.log", "mixed.asc", "classical.trc"] {
        let bytes = data(name);
        let (intact, _) = frames(&bytes);
        let mut damaged = bytes.clone();
        let at = bytes.len() / 2;
        let line = damaged[..at]
            .iter()
            .rposition(|&byte| byte == b'\n')
            .unwrap()
            + 1;
        damaged[line] = b'#';
        let (found, lost) = frames(&damaged);
        assert_eq!(
            (found.len(), lost.len()),
            (intact.len() - 1, 1),
            "{name}: {lost:?}"
        );
    }
}

#[test]
fn a_file_that_is_cut_gives_its_beginning() {
    for name in FILES {
        let bytes = data(name);
        let (intact, _) = frames(&bytes);
        let cut = bytes.len() * 3 / 4 + 3;
        let Ok(mut source) = Container::open(Cursor::new(&bytes[..cut])) else {
            panic!("{name}: not opened")
        };
        let mut frame = Frame::default();
        let mut count = 0;
        while source.next_frame(&mut frame).unwrap() {
            count += 1;
        }
        assert!(count < intact.len(), "{name}");
        assert!(!source.lost().is_empty(), "{name}: nothing was told");
    }
}

#[test]
fn a_damaged_container_of_a_blf_file_costs_its_frames_only() {
    // three files of one container each, as if they were one of three
    let bytes = data("mixed.blf");
    let containers = &bytes[144..];
    let three = [&bytes[..], containers, containers].concat();
    let (intact, lost) = frames(&three);
    assert_eq!((intact.len(), lost.len()), (360, 0));
    let mut damaged = three.clone();
    let middle = 144 + containers.len() + containers.len() / 2;
    for byte in &mut damaged[middle..middle + 8] {
        *byte ^= 0x55;
    }
    let (found, lost) = frames(&damaged);
    assert!((240..360).contains(&found.len()), "{}", found.len());
    assert!(!lost.is_empty());
    assert_eq!(found[..120], intact[..120]);
    assert_eq!(found[found.len() - 120..], intact[240..]);
}

#[test]
fn any_changed_byte_is_survived() {
    for name in FILES {
        let bytes = data(name);
        // every byte of the descriptions, some of the data
        let step = (bytes.len() / 400).max(1);
        for at in (0..bytes.len()).step_by(step) {
            for flip in [0x01, 0x80, 0xff] {
                let mut damaged = bytes.clone();
                damaged[at] ^= flip;
                let Ok(mut source) = Container::open(Cursor::new(&damaged[..])) else {
                    continue;
                };
                let mut frame = Frame::default();
                let mut count = 0;
                while source.next_frame(&mut frame).unwrap() {
                    count += 1;
                    assert!(
                        count < 100_000,
                        "{name}: endless after a change at byte {at}"
                    );
                }
            }
        }
    }
}

/// Every link of a file leads back to each block of its list, one at a time: no list is read without end.
#[test]
fn lists_that_lead_back_into_themselves_end() {
    let bytes = data("mixed.mf4");
    let blocks: Vec<usize> = (0..bytes.len() - 24)
        .step_by(8)
        .filter(|&at| &bytes[at..at + 2] == b"##" && bytes[at + 2..at + 4].is_ascii())
        .collect();
    assert!(blocks.len() > 10, "{blocks:?}");
    for &from in &blocks {
        let kind = &bytes[from..from + 4];
        for &to in blocks.iter().filter(|&&to| &bytes[to..to + 4] == kind) {
            let mut bytes = bytes.clone();
            // the first link of a list leads to its next block
            bytes[from + 24..from + 32].copy_from_slice(&(to as u64).to_le_bytes());
            let Ok(mut source) = Container::open_as(ContainerFormat::Mf4, Cursor::new(&bytes[..]))
            else {
                continue;
            };
            let mut frame = Frame::default();
            let mut frames = 0;
            while source.next_frame(&mut frame).unwrap_or(false) {
                frames += 1;
                assert!(frames < bytes.len(), "{from} {to}");
            }
        }
    }
}
