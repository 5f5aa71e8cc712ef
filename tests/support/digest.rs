//! Values of one column in one line, and how far two such lines are apart.

use std::collections::BTreeMap;
use std::fmt;

/// Largest change of a number that counts as none, as a share of the largest magnitude in its line: some bits of a
/// mathematical function of another platform, far below what any reader of a result sees.
pub const BOUND: f64 = 1e-9;

/// Values that a line shows one by one.
const FEW: usize = 4;
/// Different names that a line counts one by one.
const FEW_NAMES: usize = 6;

/// A value.
#[derive(Debug, Clone, PartialEq)]
pub enum Item {
    /// No value.
    Null,
    /// A number, which may change within the bound.
    Number(f64),
    /// A whole number, which may not.
    Integer(i128),
    /// A name, a truth value or a list.
    Name(String),
}

impl fmt::Display for Item {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Null => f.write_str("null"),
            // the sign of NaN is not specified
            Self::Number(number) if number.is_nan() => f.write_str("nan"),
            Self::Number(number) => write!(f, "{number:?}"),
            Self::Integer(integer) => write!(f, "{integer}"),
            Self::Name(name) => f.write_str(name),
        }
    }
}

/// The values of a column.
#[derive(Debug, Default)]
pub struct Digest {
    items: Vec<Item>,
}

impl Digest {
    /// Adds the next value.
    pub fn add(&mut self, item: Item) {
        self.items.push(item);
    }

    fn numbers(&self) -> Vec<f64> {
        let number = |item: &Item| match item {
            Item::Number(number) => Some(*number),
            Item::Integer(integer) => Some(*integer as f64),
            _ => None,
        };
        self.items.iter().filter_map(number).collect()
    }

    /// The values, if they are whole numbers and nothing else but nulls.
    fn integers(&self) -> Option<Vec<i128>> {
        let integer = |item: &Item| match item {
            Item::Integer(integer) => Some(*integer),
            _ => None,
        };
        let items = self.items.iter().filter(|item| **item != Item::Null);
        let integers: Option<Vec<i128>> = items.map(integer).collect();
        integers.filter(|integers| !integers.is_empty())
    }

    fn names(&self) -> BTreeMap<String, usize> {
        let mut counts = BTreeMap::new();
        for item in &self.items {
            if matches!(item, Item::Null | Item::Name(_)) {
                *counts.entry(item.to_string()).or_default() += 1;
            }
        }
        counts
    }

    /// Fowler-Noll-Vo, 64 bits: not cryptographic, but short, fast and the same everywhere.
    fn hash(&self) -> u64 {
        let mut hash = 0xcbf2_9ce4_8422_2325;
        let mut add = |bytes: &[u8]| {
            for &byte in bytes {
                hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
            }
        };
        for item in &self.items {
            match item {
                Item::Number(number) if !number.is_nan() => add(&number.to_bits().to_le_bytes()),
                Item::Integer(integer) => add(&integer.to_le_bytes()),
                other => add(other.to_string().as_bytes()),
            }
            add(&[0xff]);
        }
        hash
    }
}

/// Few values as they are. Otherwise their number; counts of names; least, largest, mean and last of the finite numbers;
/// hash of all.
impl fmt::Display for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.items.len() <= FEW {
            let texts: Vec<String> = self.items.iter().map(Item::to_string).collect();
            return f.write_str(&texts.join(", "));
        }
        write!(f, "{} values", self.items.len())?;
        let names = self.names();
        if names.len() > FEW_NAMES {
            write!(f, ", {} names", names.len())?;
        } else {
            for (name, count) in &names {
                write!(f, ", {count} x {name}")?;
            }
        }
        if let Some(integers) = self.integers() {
            let (least, largest) = (integers.iter().min(), integers.iter().max());
            let (Some(least), Some(largest), Some(last)) = (least, largest, integers.last()) else {
                return Ok(());
            };
            let mean = integers.iter().sum::<i128>() / integers.len() as i128;
            write!(f, ", min {least}, max {largest}, mean {mean}, last {last}")?;
            return write!(f, ", hash {:016x}", self.hash());
        }
        let all = self.numbers();
        let finite: Vec<f64> = all.iter().copied().filter(|x| x.is_finite()).collect();
        if all.len() > finite.len() {
            write!(f, ", {} not finite", all.len() - finite.len())?;
        }
        if let Some(last) = finite.last() {
            let least = finite.iter().copied().fold(f64::INFINITY, f64::min);
            let largest = finite.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let mean = finite.iter().sum::<f64>() / finite.len() as f64;
            write!(
                f,
                ", min {least:?}, max {largest:?}, mean {mean:?}, last {last:?}"
            )?;
        }
        write!(f, ", hash {:016x}", self.hash())
    }
}

/// Difference between two lines of values.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// Not at all, to the bit.
    None,
    /// Within [`BOUND`].
    WithinBound,
    /// Further: the numbers that differ, or both texts.
    Beyond(String),
}

/// Compares two lines as [`Digest`] shows them.
#[must_use]
pub fn change(recorded: &str, found: &str) -> Change {
    if recorded == found {
        return Change::None;
    }
    let (old, new) = (parts(recorded), parts(found));
    let same_parts =
        old.len() == new.len() && old.iter().zip(&new).all(|(old, new)| old.0 == new.0);
    if !same_parts {
        return Change::Beyond(format!("recorded {recorded}\n      found    {found}"));
    }
    let number = |text: &str| text.parse::<f64>().ok().filter(|x| x.is_finite());
    let magnitudes = old.iter().chain(&new).filter_map(|part| number(part.1));
    let scale = magnitudes.fold(0.0, |scale: f64, x| scale.max(x.abs()));
    let mut beyond = Vec::new();
    for (&(name, old), &(_, new)) in old.iter().zip(&new) {
        match (number(old), number(new)) {
            _ if old == new || name == "hash" => {}
            (Some(a), Some(b)) if is_fraction(old) && (b - a).abs() <= BOUND * scale => {}
            (Some(a), Some(b)) => beyond.push(format!("{name} {old} -> {new} ({:+.3e})", b - a)),
            _ => beyond.push(format!("{name} {old} -> {new}")),
        }
    }
    let has_numbers = old.iter().any(|part| is_fraction(part.1));
    match (beyond.is_empty(), has_numbers) {
        (true, true) => Change::WithinBound,
        (true, false) => Change::Beyond("the order or the values of names changed".into()),
        (false, _) => Change::Beyond(beyond.join(", ").trim_start().to_string()),
    }
}

/// A number that may change within the bound is written with a point or an exponent.
fn is_fraction(text: &str) -> bool {
    text.parse::<f64>().is_ok() && text.contains(['.', 'e'])
}

/// Named parts of a line: "min 1.5" is ("min", "1.5").
fn parts(line: &str) -> Vec<(&str, &str)> {
    let named = |part| str::rsplit_once(part, ' ').unwrap_or(("", part));
    line.split(", ").map(named).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(values: &[f64]) -> String {
        let mut digest = Digest::default();
        for &value in values {
            digest.add(Item::Number(value));
        }
        digest.to_string()
    }

    #[test]
    fn few_values_are_shown_and_many_are_summarised() {
        assert_eq!(line(&[1.5, f64::NAN]), "1.5, nan");
        let many = line(&[1.0, 2.0, 4.0, 3.0, 2.5]);
        assert!(many.starts_with("5 values, min 1.0, max 4.0, mean 2.5, last 2.5, hash "));
    }

    #[test]
    fn the_last_bits_are_within_the_bound_and_a_millionth_is_not() {
        let values = [1000.0, 2.0, 4.0, 3.0, 2.5];
        let with = |x: f64| line(&[1000.0, 2.0, 4.0, 3.0, x]);
        let of = |x| change(&line(&values), &with(x));
        assert_eq!(of(2.5), Change::None);
        assert_eq!(of(2.5 + 1e-10), Change::WithinBound);
        let Change::Beyond(text) = of(2.6) else {
            panic!("{:?}", of(2.6))
        };
        assert!(text.contains("last 2.5 -> 2.6"), "{text}");
        assert!(matches!(change("1.5", "1.5000001"), Change::Beyond(_)));
        assert_eq!(
            change("1.5, 2.5", "1.5, 2.5000000000001"),
            Change::WithinBound
        );
    }

    #[test]
    fn whole_numbers_names_and_their_counts_may_not_change() {
        for (old, new) in [
            ("7", "8"),
            ("null", "1.5"),
            ("true", "false"),
            (
                "5 values, 5 x true, hash 1",
                "5 values, 4 x true, 1 x false, hash 2",
            ),
            (
                "5 values, 3 x a, 2 x b, hash 1",
                "5 values, 3 x a, 2 x b, hash 2",
            ),
        ] {
            assert!(
                matches!(change(old, new), Change::Beyond(_)),
                "{old} -> {new}"
            );
        }
    }

    #[test]
    fn times_in_nanoseconds_keep_their_digits() {
        let mut digest = Digest::default();
        for k in 0..5 {
            digest.add(Item::Integer(1_780_000_000_000_000_000 + k * 1_000_000_000));
        }
        let text = digest.to_string();
        assert!(text.starts_with(
            "5 values, min 1780000000000000000, max 1780000004000000000, mean 1780000002"
        ));
        let later = text.replace("last 1780000004000000000", "last 1780000004000000001");
        assert!(matches!(change(&text, &later), Change::Beyond(_)));
    }
}
