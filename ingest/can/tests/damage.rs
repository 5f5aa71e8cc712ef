//! Damaged files give their intact frames and report their losses.

use std::io::{Cursor, Write};

use flate2::{Compression, write::ZlibEncoder};
use tipwatch_can::{Container, ContainerFormat, Frame, FrameSource};

use crate::{
    containers::blf_object,
    support::{data, frames},
};

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
        let mut source = Container::open(Cursor::new(&damaged)).unwrap();
        let mut frame = Frame::default();
        while source.next_frame(&mut frame).unwrap() {}
        let [only] = source.lost() else {
            panic!("{name}: {:?}", source.lost());
        };
        assert!(
            only.before_ns.is_some() && only.after_ns <= only.before_ns,
            "{name}: {only:?}"
        );
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

/// A BLF file of containers of 1000 bytes, in which objects go on from one into the next, and where each container begins.
fn blf_of_containers() -> (Vec<u8>, Vec<usize>) {
    let object = |count: u64| {
        let mut body = vec![1, 0, 0, 8, 0x23, 1, 0, 0];
        body.extend((count * 0x0101_0101).to_le_bytes());
        blf_object(1, count * 1_000_000, &body)
    };
    let objects: Vec<u8> = (0..200).flat_map(object).collect();
    let mut file = b"LOGG".to_vec();
    file.extend(144_u32.to_le_bytes());
    file.resize(144, 0);
    let mut begins = Vec::new();
    for part in objects.chunks(1000) {
        begins.push(file.len());
        let mut zlib = ZlibEncoder::new(Vec::new(), Compression::default());
        zlib.write_all(part).unwrap();
        let packed = zlib.finish().unwrap();
        file.extend(b"LOBJ\x10\0\x01\0");
        file.extend((32 + packed.len() as u32).to_le_bytes());
        file.extend(10_u32.to_le_bytes());
        file.extend([2, 0, 0, 0, 0, 0, 0, 0]);
        file.extend((part.len() as u32).to_le_bytes());
        file.extend([0; 4]);
        file.extend(packed);
        file.resize(file.len().next_multiple_of(4), 0);
    }
    (file, begins)
}

/// No frame is made of the parts of two objects, and every one outside the damage is there.
#[test]
fn a_blf_container_that_is_missing_or_damaged_adds_no_frame() {
    let (file, begins) = blf_of_containers();
    let (intact, lost) = frames(&file);
    assert_eq!((intact.len(), lost.len()), (200, 0));
    let one = begins[3]..begins[4];
    let without = [&file[..one.start], &file[one.end..]].concat();
    let changed = |change: &dyn Fn(&mut [u8])| {
        let mut file = file.clone();
        change(file.as_mut_slice());
        file
    };
    let set = |at: usize, number: u32| {
        changed(&|file| file[at..at + 4].copy_from_slice(&number.to_le_bytes()))
    };
    let cases = [
        ("missing", without, 178),
        ("zeros", changed(&|file| file[one.clone()].fill(0)), 178),
        // the content is whole, whatever its header says
        ("declared too short", set(begins[3] + 24, 0), 200),
        ("size over the next one", set(begins[3] + 8, 1000), 200),
        ("size over the end", set(begins[3] + 8, 1 << 20), 200),
        ("size too short", set(begins[3] + 8, 100), 178),
        (
            "damaged",
            changed(&|file| file[one.start + 80..one.start + 84].fill(0xff)),
            178,
        ),
    ];
    for (name, damaged, least) in cases {
        let (found, lost) = frames(&damaged);
        assert!(found.len() >= least, "{name}: {}", found.len());
        assert!(!lost.is_empty(), "{name}");
        let elsewhere = intact[..62].iter().chain(&intact[84..]);
        elsewhere.for_each(|frame| assert!(found.contains(frame), "{name}: {frame:?}"));
        // what is left of a damaged container is not verified
        let is_recorded = |frame| name == "damaged" || intact.contains(frame);
        assert!(found.iter().all(is_recorded), "{name}");
    }
}

/// After a loss of power, zeros stand behind what was written: they complete no frame.
#[test]
fn bytes_that_were_never_written_are_no_frames() {
    for name in FILES
        .into_iter()
        .filter(|name| name.ends_with(".blf") || name.ends_with(".mf4"))
    {
        let bytes = data(name);
        for end in (bytes.len() / 2..bytes.len()).step_by(101) {
            let cut = &bytes[..end];
            if cut.ends_with(&[0]) || Container::open(Cursor::new(cut)).is_err() {
                continue;
            }
            let zeros = [cut, &[0; 5000]].concat();
            assert_eq!(frames(&zeros).0, frames(cut).0, "{name} cut at {end}");
        }
    }
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
