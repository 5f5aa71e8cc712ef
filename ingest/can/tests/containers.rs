//! Every format gives the frames that python-can and asammdf wrote.

use std::io::{BufReader, Cursor, Read};

use tipwatch_can::{CandumpStream, Container, ContainerFormat, Frame, FrameKind, FrameSource};

use crate::support::{data, frames, listed, text};

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

/// Virtual channels with conversions, a virtual master, most length and variable length data, mixed records, packed
/// blocks that part a record, and a bus that only a source names.
#[test]
fn val_layouts_of_mf4_loggers_are_read_as_asammdf_reads_them() {
    let listed = text("layouts.txt");
    let mut names: Vec<&str> = listed.lines().filter_map(|l| l.split(' ').next()).collect();
    names.dedup();
    assert_eq!(names.len(), 6);
    for name in names {
        let (found, lost) = frames(&data(name));
        assert_eq!(lost, [""; 0], "{name}");
        let mut found: Vec<String> = (found.iter())
            .map(|(channel, frame)| {
                let kind = match frame.kind {
                    FrameKind::Data => "data",
                    FrameKind::Remote => "remote",
                    FrameKind::Error => "error",
                };
                let digits: String = frame.data().iter().map(|b| format!("{b:02x}")).collect();
                format!(
                    "{name} {} {} {kind} {:x} {} {} {digits}",
                    frame.time_ns - START_NS,
                    channel.strip_prefix("can").unwrap(),
                    frame.id.raw,
                    u8::from(frame.id.is_extended),
                    u8::from(frame.is_fd)
                )
            })
            .collect();
        let of_file = |line: &&str| line.starts_with(name);
        let mut expected: Vec<&str> = listed.lines().filter(of_file).collect();
        found.sort_unstable();
        expected.sort_unstable();
        assert_eq!(found, expected, "{name}");
    }
}

#[test]
fn formats_are_seen_in_the_content() {
    let cases = [
        ("mixed.log", Some(ContainerFormat::Candump)),
        ("mixed.asc", Some(ContainerFormat::Asc)),
        ("mixed.blf", Some(ContainerFormat::Blf)),
        ("mixed.mf4", Some(ContainerFormat::Mf4)),
        ("classical.trc", Some(ContainerFormat::Trc)),
        ("classical_1_0.trc", Some(ContainerFormat::Trc)),
        ("machine.dbc", None),
        ("decoded.csv", None),
        ("frames.txt", None),
    ];
    for (name, expected) in cases {
        assert_eq!(ContainerFormat::of(&data(name)), expected, "{name}");
    }
    assert_eq!(ContainerFormat::of(b""), None);
}

/// Someone cut frames out of a long trace.
#[test]
fn an_asc_file_without_its_header_is_read_as_hexadecimal() {
    let text = "   6.474846 1  18FECA03x       Rx   d 2 04 FF  Length = 559804 BitCount = 144 ID = 419351043x\n";
    let mut source = Container::open(Cursor::new(text)).unwrap();
    assert_eq!(source.format(), ContainerFormat::Asc);
    let mut frame = Frame::default();
    assert!(source.next_frame(&mut frame).unwrap());
    assert_eq!(
        (frame.time_ns, frame.data()),
        (6_474_846_000, &[0x04, 0xff][..])
    );
    assert!(
        source
            .notes()
            .iter()
            .any(|note| note.contains("hexadecimal"))
    );
}

/// Editors and other programs of Windows write a mark before the text.
#[test]
fn the_mark_of_a_text_in_utf_8_belongs_to_no_line() {
    for name in ["mixed.log", "mixed.asc", "classical.trc"] {
        let plain = data(name);
        let marked = [b"\xef\xbb\xbf", &plain[..]].concat();
        assert_eq!(ContainerFormat::of(&marked), ContainerFormat::of(&plain));
        let of_frames = |bytes: &[u8]| {
            let (found, lost) = frames(bytes);
            let times: Vec<i64> = found.iter().map(|(_, frame)| frame.time_ns).collect();
            (times, lost)
        };
        assert_eq!(of_frames(&marked), of_frames(&plain), "{name}");
    }
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

/// Times after the first frame in milliseconds, interfaces and lengths of the frames that a text gives.
fn candump(text: &str) -> (Vec<(i64, String, usize)>, Vec<String>) {
    let mut source = Container::open(Cursor::new(text)).unwrap();
    let mut found = Vec::new();
    let mut frame = Frame::default();
    while source.next_frame(&mut frame).unwrap() {
        let channel = source.channels()[frame.channel].clone();
        found.push((frame.time_ns / 1_000_000, channel, frame.data().len()));
    }
    assert_eq!(source.lost(), []);
    (found, source.notes().to_vec())
}

/// Intervals between frames in milliseconds, none like the one before.
const INTERVALS_MS: [i64; 8] = [0, 10, 9, 12, 10, 8, 11, 10];

/// Frames on two interfaces with stamps that `stamp` makes of the milliseconds since the first frame and since the one
/// before.
fn printed(stamp: impl Fn(i64, i64) -> String) -> String {
    let mut time_ms = 0;
    let line = |(place, interval): (usize, i64)| {
        time_ms += interval;
        let stamp = stamp(time_ms, interval);
        format!(
            " ({stamp})  can{}  RX - E  1{place:02X}   [2]  AB CD\n",
            place % 2
        )
    };
    INTERVALS_MS.into_iter().enumerate().map(line).collect()
}

#[test]
fn every_kind_of_time_of_candump_is_read() {
    let seconds = |ms: i64| format!("{:03}.{:03}000", ms / 1000, ms % 1000);
    let expected: Vec<i64> = INTERVALS_MS
        .iter()
        .scan(0, |sum, interval| {
            *sum += interval;
            Some(*sum)
        })
        .collect();
    let start_ms = START_NS / 1_000_000;
    let cases = [
        (
            printed(|ms, _| format!("17000000{}", &seconds(ms)[1..])),
            start_ms,
            "",
        ),
        (
            printed(|ms, _| format!("2023-11-14 22:13:20.{ms:03}000")),
            start_ms,
            "UTC",
        ),
        (printed(|ms, _| seconds(ms)), 0, "-tz"),
        (printed(|_, interval| seconds(interval)), 0, "-td"),
    ];
    for (text, start_ms, note) in cases {
        let (found, notes) = candump(&text);
        for (place, (time_ms, channel, len)) in found.iter().enumerate() {
            assert_eq!(*time_ms, start_ms + expected[place], "{text}");
            assert_eq!((channel.as_str(), *len), (["can0", "can1"][place % 2], 2));
        }
        assert_eq!(found.len(), 8, "{text}");
        assert!(notes.concat().contains(note), "{notes:?}");
    }
}

/// A stream gives the same frames as a file; times of another program are not held back.
#[test]
fn kinds_of_time_are_told_in_a_stream_too() {
    let seconds = |ms: i64| format!("{:03}.{:03}000", ms / 1000, ms % 1000);
    for is_interval in [false, true] {
        let text = printed(|ms, interval| seconds(if is_interval { interval } else { ms }));
        let mut source = CandumpStream::new(text.as_bytes());
        let mut frame = Frame::default();
        let mut times = Vec::new();
        while source.next_frame(&mut frame).unwrap() {
            let channel = source.channels()[frame.channel].clone();
            times.push((frame.time_ns / 1_000_000, channel, frame.data().len()));
        }
        assert_eq!(times, candump(&text).0);
        assert_eq!(source.refused().0, 0);
    }
    let untold = " (000.000000)  can0  123   [1]  00\n".repeat(3);
    let mut source = CandumpStream::new(untold.as_bytes());
    let error = source.next_frame(&mut Frame::default()).unwrap_err();
    assert!(error.to_string().contains("candump -l"), "{error}");
    // the second line never comes
    let waiting = "(12.5) can0 123#00\n".as_bytes().chain(Silent);
    let mut source = CandumpStream::new(BufReader::new(waiting));
    let mut frame = Frame::default();
    assert!(source.next_frame(&mut frame).unwrap());
    assert_eq!(frame.time_ns, 12_500_000_000);
}

/// A pipe from which nothing more may be read.
struct Silent;

impl Read for Silent {
    fn read(&mut self, _: &mut [u8]) -> std::io::Result<usize> {
        panic!("a frame was held back")
    }
}

#[test]
fn times_of_candump_that_may_be_either_are_refused_with_the_way_out() {
    let lines = |stamps: &[&str]| -> String {
        stamps
            .iter()
            .map(|stamp| format!("{stamp}  can0  123   [1]  00\n"))
            .collect()
    };
    let untold = lines(&[" (000.000000)", " (000.010000)", " (000.020000)"]);
    let untimed = lines(&[" ", " "]);
    for (text, expected) in [(untold, "-td"), (untimed, "with a time")] {
        assert_eq!(
            ContainerFormat::of(text.as_bytes()),
            Some(ContainerFormat::Candump)
        );
        let error = Container::open(Cursor::new(text)).unwrap_err().to_string();
        assert!(
            error.contains(expected) && error.contains("candump -l"),
            "{error}"
        );
    }
}

#[test]
fn what_candump_prints_between_frames_is_no_frame() {
    let text = "\u{1b}[31m (1700000000.5)  can0  20000004   [8]  00 04 00 00 00 00 00 00   ERRORFRAME\u{1b}[0m\n\
        \tcontroller-problem{rx-error-warning}\n\
        DROPCOUNT: dropped 3 CAN frames on 'can0' socket (total drops 3)\n \
        (1700000001.0)  can0  TX B -  321  [12]  00 01 02 03 04 05 06 07 08 09 0A 0B   '............'\n \
        (1700000001.5)  can0  123   {A}  00 01 02 03 04 05 06 07\n";
    let (found, lost) = frames(text.as_bytes());
    let kinds: Vec<_> = found
        .iter()
        .map(|(_, f)| (f.kind, f.is_fd, f.data().len()))
        .collect();
    let expected = [
        (FrameKind::Error, false, 8),
        (FrameKind::Data, true, 12),
        (FrameKind::Data, false, 8),
    ];
    assert_eq!(kinds, expected);
    assert_eq!(lost.len(), 1);
    assert!(lost[0].contains("dropped 3 CAN frames"), "{lost:?}");
}

#[test]
fn frames_of_can_xl_in_asc_are_left_out_with_a_note() {
    let text = "base hex  timestamps absolute\n0.01 1  101 Rx d 2 01 02\n0.02 CANXL 1 Rx 1 2 3\n0.03 1  101 Rx d 2 01 02\n";
    let mut source = Container::open(Cursor::new(text)).unwrap();
    let (mut frame, mut count) = (Frame::default(), 0);
    while source.next_frame(&mut frame).unwrap() {
        count += 1;
    }
    assert_eq!(count, 2);
    assert_eq!((source.lost().len(), source.notes().len()), (0, 1));
}

#[test]
fn frames_of_can_xl_are_left_out_and_lost_lines_have_their_number() {
    let xl = "(1700000000.2) can0 45123#81:00:12345678#1122\n(1700000000.3)  can0  TX - -  45123###81:00:12345678  [0002]  11 22\n";
    let text = format!(
        "(1700000000.1) can0 101#01\n{xl}(1700000000.4) can0 101#0\n(1700000000.5) can0 101#02\n"
    );
    for text in [xl.to_owned() + &text, text] {
        let mut source = Container::open(Cursor::new(&text)).unwrap();
        let mut frame = Frame::default();
        let mut times_ms = Vec::new();
        while source.next_frame(&mut frame).unwrap() {
            times_ms.push(frame.time_ns / 1_000_000 - 1_700_000_000_000);
        }
        assert_eq!(times_ms, [100, 500]);
        let wrong = text.lines().position(|line| line.ends_with("#0")).unwrap() + 1;
        let [lost] = source.lost() else {
            panic!("{:?}", source.lost());
        };
        assert!(
            lost.reason.starts_with(&format!("line {wrong}: ")),
            "{lost:?}"
        );
        assert_eq!(source.notes().len(), 1);
    }
    // a digit is missing or too much: no frame of CAN XL, but a damaged line
    for damaged in [
        "12345#1122334455667788",
        "0CF00##11122",
        "45123#81:00:1234567#1122",
    ] {
        let text = format!("(1700000000.1) can0 101#01\n(1700000000.2) can0 {damaged}\n");
        let mut source = Container::open(Cursor::new(&text)).unwrap();
        let mut frame = Frame::default();
        while source.next_frame(&mut frame).unwrap() {}
        assert_eq!(
            (source.lost().len(), source.notes().len()),
            (1, 0),
            "{damaged}"
        );
    }
    let mut only = Container::open(Cursor::new(xl)).unwrap();
    assert!(!only.next_frame(&mut Frame::default()).unwrap());
    assert_eq!((only.lost().len(), only.notes().len()), (0, 1));
}

#[test]
fn val_pcan_traces_of_python_can_are_read() {
    let expected: Vec<Frame> = listed()
        .into_iter()
        .filter(|frame| frame.kind == FrameKind::Data && !frame.is_fd)
        .collect();
    // version 1.0 has whole milliseconds, and no buses
    for (name, step_ns, buses) in [
        ("classical.trc", 1_000, ["can1", "can2"]),
        ("classical_1_0.trc", 600_000, ["can1", "can1"]),
    ] {
        let (found, lost) = frames(&data(name));
        assert_eq!(lost, [""; 0], "{name}");
        assert_eq!(found.len(), expected.len(), "{name}");
        assert!((found[0].1.time_ns - START_NS).abs() < 1_000, "{name}");
        for ((channel, found), expected) in found.iter().zip(&expected) {
            let drift = found.time_ns - START_NS - expected.time_ns;
            assert!(drift.abs() <= step_ns, "{name}: {drift} ns");
            assert_eq!(channel, buses[expected.channel], "{name}");
            assert_eq!(
                (found.id, found.data()),
                (expected.id, expected.data()),
                "{name}"
            );
        }
    }
}

/// A frame in short: milliseconds, bus, kind, identifier, 29 bits, CAN FD, data.
type Short = (i64, String, FrameKind, u32, bool, bool, Vec<u8>);

#[test]
fn every_version_of_pcan_traces_is_read() {
    use FrameKind::{Data, Error, Remote};
    let start = "$STARTTIME=45244.92592592593";
    let one = |version: &str, bus: &str, reserved: &str| {
        format!(
            ";$FILEVERSION={version}\n;{start}\n;\n\
                 1)      1059.9 {bus} Rx         0300 {reserved} 2  0A 0B\n\
                 2)      1283.2 {bus} Tx     18EFC034 {reserved} 0\n\
                 3)      1346.8 {bus} Warng  FFFFFFFF {reserved} 4  00 00 00 04  BUSLIGHT\n\
                 4)      1349.2 {bus} Error      0008 {reserved} 4  00 19 08 08\n\
                 5)      1352.7 {bus} Rx         0100 {reserved} 3  RTR\n"
        )
    };
    let two = |version: &str, columns: &str, bus: &str, reserved: &str, length: &str| {
        format!(
            ";$FILEVERSION={version}\n;{start}\n;$COLUMNS={columns}\n;\n\
                  1      1059.900 DT {bus}     0300 Rx {reserved} 2  0A 0B\n\
                  2      1283.200 FB {bus} 18EFC034 Tx {reserved} {length}  01 02 03 04 05 06 07 08 09 0A 0B 0C\n\
                  3      1346.800 ST {bus}        - Rx {reserved} 4  00 00 00 08\n\
                  4      1349.200 ER {bus}        - Rx {reserved} 5  04 00 02 00 00\n\
                  5      1352.700 RR {bus}     0100 Rx {reserved} 3\n\
                  6      1353.000 EV {bus} User-defined event\n"
        )
    };
    let long: Vec<u8> = (1..=12).collect();
    let (no_data, two_bytes) = (Vec::new(), vec![10, 11]);
    let first = ";##########\n;\n;    Start time: 14.11.2023 22:13:20.000.0\n;    PCAN-Net: PCI1\n;\n\
             1)      1060      0300  2  0A 0B\n     2)      1283  18EFC034  0\n\
             3)      1347  FFFFFFFF  4  00 00 00 04 ------BUSLIGHT\n\
             4)      1349      0008  4  ERROR 00 19 08 08\n     5)      1353      0100  3  RTR\n";
    let cases = [
        (first.to_owned(), "can1", false),
        (one("1.1", "", ""), "can1", false),
        (one("1.2", "2", ""), "can2", false),
        (one("1.3", "2", "-"), "can2", false),
        (two("2.0", "N,O,T,I,d,l,D", "", "", "12"), "can1", true),
        (two("2.1", "N,O,T,B,I,d,R,L,D", "2", "-", "9"), "can2", true),
    ];
    for (text, bus, has_fd) in cases {
        assert_eq!(
            ContainerFormat::of(text.as_bytes()),
            Some(ContainerFormat::Trc),
            "{text}"
        );
        let (found, lost) = frames(text.as_bytes());
        assert_eq!(lost, [""; 0], "{text}");
        let found: Vec<Short> = (found.into_iter())
            .map(|(channel, f)| {
                let ms = ((f.time_ns - START_NS) as f64 * 1e-6).round() as i64;
                let data = f.data().to_vec();
                (
                    ms,
                    channel,
                    f.kind,
                    f.id.raw,
                    f.id.is_extended,
                    f.is_fd,
                    data,
                )
            })
            .collect();
        let bus = bus.to_owned();
        let second = if has_fd {
            long.clone()
        } else {
            no_data.clone()
        };
        let expected: [Short; 4] = [
            (
                1060,
                bus.clone(),
                Data,
                0x300,
                false,
                false,
                two_bytes.clone(),
            ),
            (1283, bus.clone(), Data, 0x18ef_c034, true, has_fd, second),
            (1349, bus.clone(), Error, 0, false, false, no_data.clone()),
            (1353, bus, Remote, 0x100, false, false, no_data.clone()),
        ];
        assert_eq!(found, expected, "{text}");
    }
}

#[test]
fn pcan_traces_that_cannot_be_read_say_the_way_out() {
    for (text, expected) in [
        (
            ";$FILEVERSION=3.0\n     1)  1.0  Rx  0300  0\n",
            "save it as version 2.1",
        ),
        (
            ";$FILEVERSION=2.1\n;$COLUMNS=N,O,T,D,I\n",
            "expected columns",
        ),
    ] {
        let error = Container::open(Cursor::new(text)).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
    // a message of several packets, and a line that is cut off
    let text = ";$FILEVERSION=1.3\n     1)  1.0  1 Rx  18ECFF00 -  20  00 01 02 03 04 05 06 07 08 09 0A 0B 0C 0D 0E 0F 10 11 12 13\n\
         2)  2.0  1 Rx  0300 -  2  00 01\n     3)  3.0  1 Rx  0300 -  2  00";
    let (found, lost) = frames(text.as_bytes());
    assert_eq!((found.len(), lost.len()), (1, 2));
    assert!(lost[0].contains("save the trace as CAN frames"), "{lost:?}");
}

/// An object of a BLF file, version 1, whose body a logger may have cut.
pub(crate) fn blf_object(kind: u32, time_ns: u64, body: &[u8]) -> Vec<u8> {
    let size = 32 + body.len() as u32;
    let mut object = b"LOBJ".to_vec();
    for part in [32_u16, 1] {
        object.extend(part.to_le_bytes());
    }
    object.extend(size.to_le_bytes());
    object.extend(kind.to_le_bytes());
    object.extend(2_u32.to_le_bytes());
    object.extend([0; 4]);
    object.extend(time_ns.to_le_bytes());
    object.extend(body);
    object
}

/// A BLF file of objects without containers.
fn blf(objects: &[Vec<u8>]) -> Vec<u8> {
    let mut file = b"LOGG".to_vec();
    file.extend(144_u32.to_le_bytes());
    file.resize(144, 0);
    for object in objects {
        file.extend(object);
        file.resize(file.len().next_multiple_of(4), 0);
    }
    file
}

/// The body of an object of each kind with 12 or 8 bytes of data, of which those from `kept` on are zero.
fn blf_bodies(kept: usize) -> Vec<(u32, usize, Vec<u8>)> {
    let id = 0x123_u32.to_le_bytes();
    let data =
        |len: usize| (0..len).map(move |place| if place < kept { place as u8 + 1 } else { 0 });
    let classical: Vec<u8> = [1, 0, 0, 8].into_iter().chain(id).chain(data(8)).collect();
    let fd = [1, 0, 0, 9]
        .into_iter()
        .chain(id)
        .chain([0; 5])
        .chain([1, 12])
        .chain([0; 5]);
    let mut fd_64 = vec![1, 9, 12, 0];
    fd_64.extend(id);
    fd_64.extend([0; 4]);
    fd_64.extend(0x1000_u32.to_le_bytes());
    fd_64.resize(40, 0);
    fd_64.extend(data(12));
    vec![
        (1, 8, classical.clone()),
        (86, 8, classical),
        (100, 12, fd.chain(data(12)).collect()),
        (101, 12, fd_64),
    ]
}

#[test]
fn blf_objects_without_their_last_zeros_are_whole_frames() {
    for kept in [0, 1, 5, 8] {
        for (kind, len, body) in blf_bodies(kept) {
            let zeros = len - kept.min(len);
            let objects: Vec<_> = (0..22)
                .map(|count| blf_object(kind, count * 1000, &body[..body.len() - zeros]))
                .collect();
            let bytes = blf(&objects);
            let mut source = Container::open(Cursor::new(&bytes)).unwrap();
            let mut frame = Frame::default();
            let mut count = 0;
            while source.next_frame(&mut frame).unwrap() {
                assert_eq!(frame.data(), &body[body.len() - len..], "type {kind}");
                count += 1;
            }
            assert_eq!((count, source.lost()), (22, &[][..]), "type {kind}");
            let is_told = source.notes().iter().any(|note| note.contains("as zero"));
            assert_eq!(is_told, zeros > 0, "type {kind}: {:?}", source.notes());
        }
    }
}

#[test]
fn blf_objects_that_end_elsewhere_are_lost() {
    for (kind, _, body) in blf_bodies(8) {
        let mut objects = vec![blf_object(kind, 0, &body); 3];
        // a size that is damaged: what follows is no object
        let size = 32 + body.len() as u32 - 6;
        objects[1][8..12].copy_from_slice(&size.to_le_bytes());
        let (found, lost) = frames(&blf(&objects));
        assert!(
            found
                .iter()
                .all(|(_, f)| f.data().ends_with(&body[body.len() - 1..]))
        );
        assert_eq!(found.len(), 2, "type {kind}");
        assert!(!lost.is_empty(), "type {kind}");
    }
}

#[test]
fn blf_error_objects_are_error_frames() {
    let objects = [2, 73, 104].map(|kind| blf_object(kind, 0, &[2, 0, 0, 0, 0, 0, 0, 0]));
    let (found, lost) = frames(&blf(&objects));
    assert_eq!(lost, [""; 0]);
    let kinds: Vec<_> = found.iter().map(|(c, f)| (c.as_str(), f.kind)).collect();
    assert_eq!(kinds, [("can2", FrameKind::Error); 3]);
}
