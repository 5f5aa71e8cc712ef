//! Frames and values that never become numbers, but are reported.

use tipwatch_can::{CanId, Database, Decoder, Frame, FrameKind, Message, Selection, Tally, j1939};

use crate::support::data;

fn message(name: &str) -> Message {
    Database::parse(&data("machine.dbc"))
        .unwrap()
        .message(name)
        .unwrap()
        .clone()
}

fn frame(id: CanId, data: &[u8]) -> Frame {
    let mut frame = Frame::default();
    frame.id = id;
    assert!(frame.set_data(data));
    frame
}

/// Returns the values of a signal over frames, and the notes.
fn decoded(message: Message, signal: &str, frames: &[Frame]) -> (Vec<f64>, Tally, Vec<String>) {
    let index = message.signal(signal).unwrap();
    let mut decoder = Decoder::new(vec![Selection::of(message.clone())]);
    let mut values = Vec::new();
    for frame in frames {
        decoder.decode(frame, &mut |_, numbers| values.push(numbers[index]));
    }
    let tally = decoder.tally(0).unwrap();
    let lines = message.told(&tally);
    (values, tally, lines)
}

#[test]
fn frames_of_a_wrong_length_give_no_numbers() {
    let id = CanId::standard(289);
    let frames = [frame(id, &[0; 8]), frame(id, &[0; 7]), frame(id, &[])];
    let (values, tally, lines) = decoded(message("SlewState"), "SlewAngle", &frames);
    assert_eq!(values.len(), 1);
    assert_eq!(tally.wrong_length, Some((2, 0)));
    assert!(
        lines[0].contains("2 of 3 frames have a wrong length (expected 8 bytes"),
        "{lines:?}"
    );
}

#[test]
fn unknown_multiplexers_are_told() {
    let id = CanId::standard(292);
    let frames = [
        frame(id, &[0, 10, 0, 0, 0, 0, 0, 0]),
        frame(id, &[9, 10, 0, 0, 0, 0, 5, 0]),
    ];
    let (values, tally, lines) = decoded(message("Multiplexed"), "LegForce", &frames);
    // 1 kN in newtons
    assert!((values[0] - 1000.0).abs() < 1e-9 && values[1].is_nan());
    assert_eq!(tally.unknown_multiplexer, Some((1, 9)));
    assert!(
        lines[0].contains("unknown multiplexer (for example 9)"),
        "{lines:?}"
    );
    // what is not multiplexed is still there
    let (values, ..) = decoded(message("Multiplexed"), "Common", &frames);
    assert_eq!(values, [0.0, 5.0]);
}

#[test]
fn standing_counters_give_no_numbers_and_standing_checksums_are_told() {
    let id = CanId::standard(288);
    let of = |angle: u8, counter: u8, checksum: u8| {
        frame(id, &[angle, 0, 0, 0, 0, 0, counter, checksum])
    };
    let frames = [
        of(1, 0, 5),
        of(2, 1, 6),
        of(3, 1, 7),
        of(3, 1, 7),
        of(4, 2, 7),
    ];
    let (values, tally, lines) = decoded(message("BoomState"), "BoomAngle", &frames);
    assert_eq!(values.len(), 3);
    assert_eq!((tally.standing_counter, tally.standing_checksum), (2, 1));
    assert!(
        lines
            .iter()
            .any(|line| line.contains("repeat the message counter")),
        "{lines:?}"
    );
}

#[test]
fn a_counter_that_never_counts_is_ignored_and_told() {
    let id = CanId::standard(288);
    let of = |angle: u8, counter: u8| frame(id, &[angle, 0, 0, 0, 0, 0, counter, angle]);
    let frames = [of(1, 0), of(2, 0), of(2, 0), of(3, 0)];
    let (values, tally, _) = decoded(message("BoomState"), "BoomAngle", &frames);
    assert_eq!(values.len(), 4);
    assert_eq!((tally.standing_counter, tally.idle_counter), (0, 2));
    // one that counts later repeats frames from then on
    let frames = [of(1, 0), of(2, 0), of(3, 1), of(4, 1)];
    let (values, tally, _) = decoded(message("BoomState"), "BoomAngle", &frames);
    assert_eq!(values.len(), 3);
    assert_eq!((tally.standing_counter, tally.idle_counter), (1, 1));
}

#[test]
fn error_and_not_available_ranges_of_j1939_are_never_numbers() {
    let id = CanId::extended(0x0cf0_0400);
    let speed = |raw: u16| {
        let [low, high] = raw.to_le_bytes();
        frame(id, &[255, 255, 255, low, high, 255, 255, 255])
    };
    let frames = [
        speed(8000),
        speed(0xff00),
        speed(0xfe12),
        speed(0xfb00),
        speed(0xfaff),
    ];
    let (values, tally, _) = decoded(message("EEC1"), "EngineSpeed", &frames);
    // 1000 revolutions a minute in radians a second
    assert!((values[0] - 1000.0 * std::f64::consts::PI / 30.0).abs() < 1e-9);
    assert!(values[1..4].iter().all(|value| value.is_nan()) && values[4].is_finite());
    assert_eq!((tally.not_available[&0], tally.errors[&0]), (1, 2));
}

#[test]
fn parameter_groups_match_any_priority_and_one_sender() {
    let group = j1939::public_group(61482).unwrap();
    let rates = |id: u32| {
        frame(
            CanId::extended(id),
            &[0, 0x7d, 0, 0x7d, 0, 0x7d, 0xff, 0xff],
        )
    };
    let frames = [
        rates(0x0cf0_2a21),
        rates(0x18f0_2a21),
        rates(0x0cf0_2a22),
        rates(0x0cf0_2b21),
    ];
    let (values, tally, _) = decoded(group.clone(), "yaw_rate", &frames);
    assert_eq!(
        values,
        [0.0, 0.0],
        "the second sender is not mixed into the first"
    );
    assert_eq!(
        tally.sources.into_iter().collect::<Vec<_>>(),
        [(0x21, 2), (0x22, 1)]
    );
    let mut decoder = Decoder::new(vec![Selection {
        source: Some(0x22),
        ..Selection::of(group)
    }]);
    let mut count = 0;
    for frame in &frames {
        decoder.decode(frame, &mut |_, _| count += 1);
    }
    assert_eq!(count, 1);
}

#[test]
fn messages_of_several_packets_are_decoded() {
    let text = "BO_ 2566787838 Long: 12 Chassis\n SG_ Last : 80|16@1+ (0.5,0) [0|0] \"kg\" Crane\n\
        BA_DEF_DEF_ \"ProtocolType\" \"J1939\";\n";
    let header = "VERSION \"\"\nNS_ :\nBS_:\nBU_: Chassis Crane\n";
    let database = Database::parse(format!("{header}{text}").as_bytes()).unwrap();
    let long = database.messages[0].clone();
    // group 65258 from any sender
    let packets = [
        (0x1cec_ff21, [32, 12, 0, 2, 255, 0xfe, 0xfe, 0]),
        (0x1ceb_ff21, [1, 0, 1, 2, 3, 4, 5, 6]),
        (0x1ceb_ff21, [2, 7, 8, 9, 0x10, 0x27, 255, 255]),
    ];
    let tipwatch_can::Addressing::ParameterGroup { pgn, .. } = long.addressing else {
        panic!("expected a parameter group, found {:?}", long.addressing)
    };
    let [low, high, page, _] = pgn.to_le_bytes();
    let frames: Vec<Frame> = packets
        .iter()
        .map(|(id, data)| {
            let mut data = *data;
            if data[0] == 32 {
                data[5..].copy_from_slice(&[low, high, page]);
            }
            frame(CanId::extended(*id), &data)
        })
        .collect();
    let (values, tally, _) = decoded(long.clone(), "Last", &frames);
    assert_eq!(values, [5000.0]);
    assert_eq!(tally.incomplete, 0);
    let (values, tally, lines) = decoded(long, "Last", &frames[..2]);
    assert!(values.is_empty());
    assert_eq!(tally.incomplete, 1);
    assert!(lines[0].contains("incomplete"), "{lines:?}");
}

#[test]
fn remote_and_error_frames_carry_no_data() {
    let kinds = [FrameKind::Remote, FrameKind::Error];
    let frames = kinds.map(|kind| {
        let mut frame = frame(CanId::standard(289), &[]);
        frame.kind = kind;
        frame
    });
    let (values, tally, _) = decoded(message("SlewState"), "SlewAngle", &frames);
    assert!(values.is_empty());
    assert_eq!((tally.remote, tally.wrong_length), (1, None));
}

#[test]
fn signals_that_do_not_fit_their_message_are_refused_with_a_reason() {
    let text = "VERSION \"\"\nNS_ :\nBS_:\nBU_: A\nBO_ 1 Short: 2 A\n SG_ Behind : 8|16@1+ (1,0) [0|0] \"\" A\n \
        SG_ Fits : 0|16@1+ (1,0) [0|0] \"\" A\n";
    let database = Database::parse(text.as_bytes()).unwrap();
    assert_eq!(
        database.notes,
        ["Short.Behind: its bits end in byte 3, its message has 2"]
    );
    assert_eq!(database.messages[0].signals.len(), 1);
    assert!(Database::parse(b"no such file").is_err());
}
