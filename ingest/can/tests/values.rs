//! Signals have the values that cantools reads, and are no numbers where the description says so.

use std::{collections::BTreeMap, io::Cursor};

use tipwatch_can::{Container, Database, Decoder, Frame, FrameSource, Message, Selection};

use crate::support::{data, text};

#[test]
fn val_signals_are_those_that_cantools_reads() {
    let database = Database::parse(&data("machine.dbc")).unwrap();
    assert_eq!(database.notes, [""; 0]);
    let mut decoder = Decoder::new(
        database
            .messages
            .iter()
            .cloned()
            .map(Selection::of)
            .collect(),
    );
    let mut source = Container::open(Cursor::new(data("machine.log"))).unwrap();
    let mut found: Vec<Vec<(String, String, f64)>> = Vec::new();
    let mut frame = Frame::default();
    while source.next_frame(&mut frame).unwrap() {
        let mut values = Vec::new();
        decoder.decode(&frame, &mut |selection, numbers| {
            let message = &database.messages[selection];
            for (signal, number) in message.signals.iter().zip(numbers) {
                let value = (number - signal.si.offset) / signal.si.factor;
                values.push((message.name.clone(), signal.name.clone(), value));
            }
        });
        found.push(values);
    }
    let (mut numbers, mut refused) = (0, 0);
    for line in text("decoded.csv").lines() {
        let parts: Vec<&str> = line.split(',').collect();
        let expected: f64 = parts[3].parse().unwrap();
        let of_frame = &found[parts[0].parse::<usize>().unwrap()];
        let (_, _, value) = of_frame
            .iter()
            .find(|(message, signal, _)| message == parts[1] && signal == parts[2])
            .unwrap_or_else(|| panic!("{line}: not decoded"));
        if is_number(database.message(parts[1]).unwrap(), parts[2], expected) {
            let error = (value - expected).abs();
            assert!(
                error <= 1e-12 * expected.abs().max(1.0),
                "{line}: found {value}"
            );
            numbers += 1;
        } else {
            assert!(value.is_nan(), "{line}: found {value}");
            refused += 1;
        }
    }
    assert!(
        numbers > 900 && refused > 10,
        "{numbers} numbers, {refused} others"
    );
    // cantools lists only what the multiplexers select: the rest is NaN here
    let selected = found
        .iter()
        .flatten()
        .filter(|(.., value)| value.is_finite())
        .count();
    assert_eq!(selected, numbers);
}

/// Nested multiplexers, long names and units in code page 1252, as cantools writes them.
#[test]
fn val_generated_files_have_the_values_that_cantools_reads() {
    check_generated(data, "1");
}

/// Compares `generated_SEED`: listed values are there, and no others.
pub(crate) fn check_generated(read: impl Fn(&str) -> Vec<u8>, seed: &str) {
    let file = |ending: &str| read(&format!("generated_{seed}.{ending}"));
    let database = Database::parse(&file("dbc")).unwrap();
    assert_eq!(database.notes, [""; 0]);
    let selections = database.messages.iter().cloned().map(Selection::of);
    let mut decoder = Decoder::new(selections.collect());
    let mut source = Container::open(Cursor::new(file("log"))).unwrap();
    let mut found = BTreeMap::new();
    let mut frame = Frame::default();
    let mut count = 0;
    while source.next_frame(&mut frame).unwrap() {
        decoder.decode(&frame, &mut |selection, numbers| {
            let message = &database.messages[selection];
            for (signal, number) in message.signals.iter().zip(numbers) {
                if number.is_finite() {
                    let value = (number - signal.si.offset) / signal.si.factor;
                    let key = format!("{count},{},{}", message.name, signal.name);
                    found.insert(key, value);
                }
            }
        });
        count += 1;
    }
    let listed = String::from_utf8(file("csv")).unwrap();
    for line in listed.lines() {
        let (key, expected) = line.rsplit_once(',').unwrap();
        let expected: f64 = expected.parse().unwrap();
        let value = found.remove(key).unwrap_or(f64::NAN);
        let error = (value - expected).abs();
        assert!(
            error <= 1e-12 * expected.abs().max(1.0),
            "{line}: found {value}"
        );
    }
    assert!(found.is_empty(), "not selected: {found:?}");
    // a multiplexer with a value that selects nothing is told
    let unknown = |place| {
        decoder
            .tally(place)
            .and_then(|tally| tally.unknown_multiplexer)
    };
    assert!((0..database.messages.len()).any(|place| unknown(place).is_some()));
}

/// Whether a value is a number by the description alone: within its range, and not the value that is called SNA or error.
fn is_number(message: &Message, signal: &str, value: f64) -> bool {
    let signal = &message.signals[message.signal(signal).unwrap()];
    let is_in = signal
        .range
        .is_none_or(|(least, most)| (least..=most).contains(&value));
    is_in && !(signal.name == "SlewMode" && value >= 6.0)
}
