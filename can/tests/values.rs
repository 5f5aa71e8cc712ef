//! Signals have the values that cantools reads, and are no numbers where the description says so.

use std::io::Cursor;

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

/// By the description alone: within its range, and not the value that is called SNA or error.
fn is_number(message: &Message, signal: &str, value: f64) -> bool {
    let signal = &message.signals[message.signal(signal).unwrap()];
    let is_in = signal
        .range
        .is_none_or(|(least, most)| (least..=most).contains(&value));
    is_in && !(signal.name == "SlewMode" && value >= 6.0)
}
