//! The signals of a message as the DBC file describes them, prepared for reading.

use std::ops::RangeInclusive;

use can_dbc::{
    ByteOrder, Dbc, Message as DbcMessage, MultiplexIndicator, NumericValue, Signal as DbcSignal,
    SignalExtendedValueType, ValueType,
};

use super::names;
use crate::{
    bits::BitRange,
    message::{Multiplexed, Signal, ValueKind},
    unit::SiUnit,
};

/// All signals of a message that fit into it, and what is wrong with the others.
pub(super) fn prepare(dbc: &Dbc, message: &DbcMessage, notes: &mut Vec<String>) -> Vec<Signal> {
    let mut kept: Vec<(&DbcSignal, Signal)> = Vec::new();
    for signal in &message.signals {
        match prepare_one(dbc, message, signal) {
            Ok(prepared) => kept.push((signal, prepared)),
            Err(problem) => notes.push(format!("{}.{}: {problem}", message.name, signal.name)),
        }
    }
    let plain_multiplexer = kept.iter().position(|(signal, _)| {
        matches!(
            signal.multiplexer_indicator,
            MultiplexIndicator::Multiplexor
        )
    });
    let multiplexed: Vec<Option<Result<Multiplexed, String>>> = (kept.iter())
        .map(|(signal, _)| {
            let (name, values) = extended(dbc, message, signal).unwrap_or_default();
            let place = |name: &str| kept.iter().position(|(signal, _)| signal.name == name);
            let value = match signal.multiplexer_indicator {
                MultiplexIndicator::Plain | MultiplexIndicator::Multiplexor => return None,
                MultiplexIndicator::MultiplexedSignal(value)
                | MultiplexIndicator::MultiplexorAndMultiplexedSignal(value) => value,
            };
            let multiplexer = if name.is_empty() {
                plain_multiplexer
            } else {
                place(name)
            };
            let values = if values.is_empty() {
                vec![value..=value]
            } else {
                values
            };
            Some(match multiplexer {
                Some(multiplexer) => Ok(Multiplexed {
                    multiplexer,
                    values,
                }),
                None => Err("its multiplexer is not in the message".to_owned()),
            })
        })
        .collect();
    let selecting: Vec<usize> = (multiplexed.iter().flatten().flatten())
        .map(|of| of.multiplexer)
        .collect();
    let mut signals = Vec::with_capacity(kept.len());
    for (place, ((_, mut signal), multiplexed)) in kept.into_iter().zip(multiplexed).enumerate() {
        signal.is_multiplexer = selecting.contains(&place);
        match multiplexed {
            None => {}
            Some(Ok(multiplexed)) => signal.multiplexed = Some(multiplexed),
            Some(Err(problem)) => {
                notes.push(format!(
                    "{}.{}: {problem}: never a number",
                    message.name, signal.name
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

/// The multiplexer of a signal and the values that select it, where the file states them separately.
fn extended<'d>(
    dbc: &'d Dbc,
    message: &DbcMessage,
    signal: &DbcSignal,
) -> Option<(&'d str, Vec<RangeInclusive<u64>>)> {
    let stated = dbc.extended_multiplex.iter();
    let mut of_signal =
        stated.filter(|of| of.message_id == message.id && of.signal_name == signal.name);
    let stated = of_signal.next()?;
    let values = stated
        .mappings
        .iter()
        .map(|range| range.min_value..=range.max_value);
    Some((&stated.multiplexor_signal_name, values.collect()))
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
        .ok_or_else(|| format!("expected 1 to 64 bits, found {size} from bit {start} on"))?;
    if bits.end() as u64 > message.size {
        return Err(format!(
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
        (Some(_), _) => return Err(format!("a floating-point number of {size} bits")),
    };
    if !signal.factor.is_finite() || !signal.offset.is_finite() || signal.factor == 0.0 {
        return Err(format!(
            "factor {} and offset {}",
            signal.factor, signal.offset
        ));
    }
    let (least, greatest) = (number(signal.min), number(signal.max));
    let si = SiUnit::of(&signal.unit);
    let descriptions = dbc.value_descriptions_for_signal(message.id, &signal.name);
    let not_numbers = (descriptions.unwrap_or_default().iter())
        .filter(|described| names::is_not_a_number(&described.description))
        .map(|described| described.id);
    let is_whole =
        matches!(kind, ValueKind::Unsigned) && signal.factor == 1.0 && signal.offset == 0.0;
    Ok(Signal {
        name: signal.name.clone(),
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
        is_counter: is_whole && (2..=16).contains(&size) && names::is_counter(&signal.name),
        is_checksum: is_whole && (4..=32).contains(&size) && names::is_checksum(&signal.name),
    })
}

fn number(value: NumericValue) -> f64 {
    match value {
        NumericValue::Uint(value) => value as f64,
        NumericValue::Int(value) => value as f64,
        NumericValue::Double(value) => value,
    }
}
