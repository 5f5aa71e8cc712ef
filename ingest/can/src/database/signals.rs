//! The signals of a message as the DBC file describes them, prepared for reading.

use std::ops::RangeInclusive;

use can_dbc::{
    ByteOrder, Dbc, Message as DbcMessage, MultiplexIndicator, NumericValue, Signal as DbcSignal,
    SignalExtendedValueType, ValueType,
};
use tipwatch_language::{say, word};

use super::names;
use crate::{
    bits::BitRange,
    message::{MOST_NESTED, Multiplexed, Signal, ValueKind},
    unit::SiUnit,
};

/// Attribute of a signal with its full name, where the name in its definition is shortened.
const LONG_NAME: &str = "SystemSignalLongSymbol";

/// Returns all signals of a message that fit into it, and notes the errors of the others.
pub(super) fn prepare(
    dbc: &Dbc,
    message: &DbcMessage,
    message_name: &str,
    notes: &mut Vec<String>,
) -> Vec<Signal> {
    let mut kept: Vec<(&DbcSignal, Signal)> = Vec::new();
    for signal in &message.signals {
        match prepare_one(dbc, message, signal) {
            Ok(prepared) => kept.push((signal, prepared)),
            Err(problem) => notes.push(format!("{message_name}.{}: {problem}", signal.name)),
        }
    }
    let multiplexers = multiplexers(dbc, message, &kept);
    let selecting: Vec<usize> = (multiplexers.iter().flatten().flatten())
        .map(|of| of.multiplexer)
        .collect();
    let mut signals: Vec<Signal> = Vec::with_capacity(kept.len());
    for (place, ((of, mut signal), multiplexed)) in kept.into_iter().zip(multiplexers).enumerate() {
        let long = dbc.signal_attribute(message.id, &of.name, LONG_NAME);
        if let Some(long) = names::long_name(long, &of.name) {
            match signals.iter().any(|other| other.name == long) {
                true => notes.push(say!(
                    "{message_name}.{}: the name {long} is that of another signal and is not used",
                    of.name
                )),
                false => {
                    signal.name = long.to_owned();
                    signal.symbol = Some(of.name.clone());
                }
            }
        }
        let is_whole =
            signal.kind == ValueKind::Unsigned && signal.factor == 1.0 && signal.offset == 0.0;
        let size = signal.bits.bit_count;
        signal.is_counter = is_whole && (2..=16).contains(&size) && names::is_counter(&signal.name);
        signal.is_checksum =
            is_whole && (4..=32).contains(&size) && names::is_checksum(&signal.name);
        signal.is_multiplexer = selecting.contains(&place);
        match multiplexed {
            None => {}
            Some(Ok(multiplexed)) => signal.multiplexed = Some(multiplexed),
            Some(Err(problem)) => {
                notes.push(say!(
                    "{message_name}.{}: {problem}: never a number",
                    signal.name
                ));
                // nothing selects it
                signal.multiplexed = Some(Multiplexed {
                    multiplexer: usize::MAX,
                    values: Vec::new(),
                });
            }
        }
        signals.push(signal);
    }
    signals
}

/// Finds for each signal the multiplexer that selects it, or the reason why it is unknown.
fn multiplexers(
    dbc: &Dbc,
    message: &DbcMessage,
    kept: &[(&DbcSignal, Signal)],
) -> Vec<Option<Result<Multiplexed, String>>> {
    // cantools writes the long name of a multiplexer, others the short one
    let place = |name: &str| {
        let short = kept.iter().position(|(signal, _)| signal.name == name);
        short.or_else(|| {
            kept.iter().position(|(signal, _)| {
                let long = dbc.signal_attribute(message.id, &signal.name, LONG_NAME);
                names::long_name(long, &signal.name) == Some(name)
            })
        })
    };
    let stated: Vec<_> = (kept.iter())
        .map(|(signal, _)| stated_multiplexer(dbc, message, signal))
        .collect();
    // some editors mark a multiplexer that another one selects like one that nothing selects
    let mut roots = (kept.iter().zip(&stated).enumerate())
        .filter(|(_, ((signal, _), stated))| {
            stated.is_none()
                && matches!(
                    signal.multiplexer_indicator,
                    MultiplexIndicator::Multiplexor
                )
        })
        .map(|(place, _)| place);
    let root = match (roots.next(), roots.next()) {
        (Some(root), None) => Ok(root),
        (None, _) => Err(word!("its multiplexer is not in the message")),
        (Some(_), Some(_)) => Err(word!(
            "its message has several multiplexers, and none is stated for it"
        )),
    };
    let mut found: Vec<_> = (kept.iter().zip(stated))
        .map(|((signal, _), stated)| {
            use MultiplexIndicator::{
                MultiplexedSignal, Multiplexor, MultiplexorAndMultiplexedSignal, Plain,
            };
            let (multiplexer, values) = match (stated, signal.multiplexer_indicator) {
                (Some(Err(problem)), _) => return Some(Err(problem)),
                (Some(Ok((name, values))), _) => {
                    let place = place(name).ok_or(word!("its multiplexer is not in the message"));
                    (place, values)
                }
                (None, Plain | Multiplexor) => return None,
                (None, MultiplexedSignal(value) | MultiplexorAndMultiplexedSignal(value)) => {
                    (root, vec![value..=value])
                }
            };
            let multiplexed = multiplexer.map(|multiplexer| Multiplexed {
                multiplexer,
                values,
            });
            Some(multiplexed.map_err(str::to_owned))
        })
        .collect();
    let has_end: Vec<bool> = (0..found.len())
        .map(|start| has_root(&found, start))
        .collect();
    for (multiplexed, has_end) in found.iter_mut().zip(has_end) {
        if let Some(multiplexed) = multiplexed
            && multiplexed.is_ok()
            && !has_end
        {
            *multiplexed = Err(say!(
                "its multiplexers select each other, or more than {MOST_NESTED} select it"
            ));
        }
    }
    found
}

/// Whether the multiplexers of a signal end with one that no multiplexer selects.
fn has_root(found: &[Option<Result<Multiplexed, String>>], start: usize) -> bool {
    let mut place = start;
    for _ in 0..=MOST_NESTED {
        match found.get(place) {
            Some(Some(Ok(of))) => place = of.multiplexer,
            _ => return true,
        }
    }
    false
}

type Stated<'d> = (&'d str, Vec<RangeInclusive<u64>>);

/// The multiplexer of a signal and the values that select it, where the file states them separately.
fn stated_multiplexer<'d>(
    dbc: &'d Dbc,
    message: &DbcMessage,
    signal: &DbcSignal,
) -> Option<Result<Stated<'d>, String>> {
    let stated = dbc.extended_multiplex.iter();
    let mut of_signal =
        stated.filter(|of| of.message_id == message.id && of.signal_name == signal.name);
    let first = of_signal.next()?;
    let name = first.multiplexor_signal_name.as_str();
    let mut mappings = first.mappings.clone();
    for other in of_signal {
        if other.multiplexor_signal_name != name {
            return Some(Err(say!(
                "two multiplexers are stated for it, {name} and {}",
                other.multiplexor_signal_name
            )));
        }
        mappings.extend(other.mappings.iter().cloned());
    }
    let values = mappings
        .iter()
        .map(|range| range.min_value..=range.max_value);
    Some(Ok((name, values.collect())))
}

fn prepare_one(dbc: &Dbc, message: &DbcMessage, signal: &DbcSignal) -> Result<Signal, String> {
    let (start, size) = (signal.start_bit, signal.size);
    let position = || {
        let (start, size) = (usize::try_from(start).ok()?, u32::try_from(size).ok()?);
        match signal.byte_order {
            ByteOrder::LittleEndian => BitRange::little_endian(start, size),
            ByteOrder::BigEndian => BitRange::big_endian(start, size),
        }
    };
    let bits = position()
        .ok_or_else(|| say!("expected 1 to 64 bits, found {size} from bit {start} on"))?;
    if bits.end() as u64 > message.size {
        return Err(say!(
            "its bits end in byte {}, its message has {}",
            bits.end(),
            message.size
        ));
    }
    let kind = match (
        dbc.extended_value_type_for_signal(message.id, &signal.name),
        size,
    ) {
        (Some(SignalExtendedValueType::IEEEfloat32Bit), 32) => ValueKind::Float32,
        (Some(SignalExtendedValueType::IEEEdouble64bit), 64) => ValueKind::Float64,
        (None | Some(SignalExtendedValueType::SignedOrUnsignedInteger), _) => {
            match signal.value_type {
                ValueType::Signed => ValueKind::Signed,
                ValueType::Unsigned => ValueKind::Unsigned,
            }
        }
        (Some(_), _) => return Err(say!("a floating-point number of {size} bits")),
    };
    if !signal.factor.is_finite() || !signal.offset.is_finite() || signal.factor == 0.0 {
        return Err(say!(
            "factor {} and offset {}",
            signal.factor,
            signal.offset
        ));
    }
    let (least, greatest) = (number(signal.min), number(signal.max));
    let si = SiUnit::of(&signal.unit);
    let descriptions = dbc.value_descriptions_for_signal(message.id, &signal.name);
    let not_numbers = (descriptions.unwrap_or_default().iter())
        .filter(|described| names::is_not_a_number(&described.description))
        .map(|described| described.id);
    Ok(Signal {
        name: signal.name.clone(),
        symbol: None,
        bits,
        kind,
        factor: signal.factor,
        offset: signal.offset,
        range: (least < greatest).then_some((least, greatest)),
        unit: signal.unit.clone(),
        si: si.unwrap_or(SiUnit::NONE),
        is_converted: si.is_some(),
        not_numbers: not_numbers.collect(),
        multiplexed: None,
        is_multiplexer: false,
        is_counter: false,
        is_checksum: false,
    })
}

fn number(value: NumericValue) -> f64 {
    match value {
        NumericValue::Uint(value) => value as f64,
        NumericValue::Int(value) => value as f64,
        NumericValue::Double(value) => value,
    }
}
