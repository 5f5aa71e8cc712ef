//! The values of a column of any type that a table can have.

use std::ops::Range;

use super::cell::Value;
use super::series::{Known, Lists, Texts};

/// The values of a column, by type; any of them may be missing.
#[derive(Debug, Clone)]
pub enum Values {
    /// Truth values.
    Boolean(Known<Vec<bool>>),
    /// Numbers of 32 bits.
    Single(Known<Vec<f32>>),
    /// Numbers of 64 bits.
    Double(Known<Vec<f64>>),
    /// Whole numbers of 32 bits.
    Int32(Known<Vec<i32>>),
    /// Whole numbers of 64 bits.
    Int64(Known<Vec<i64>>),
    /// Counts of 32 bits.
    UInt32(Known<Vec<u32>>),
    /// Counts of 64 bits.
    UInt64(Known<Vec<u64>>),
    /// Texts.
    Text(Known<Texts>),
    /// Lists of numbers.
    Numbers(Lists<Vec<f64>>),
    /// Lists of texts.
    Texts(Lists<Texts>),
}

/// Does the same for every type: with the series of one column, or with those of two of the same type.
macro_rules! of_each_type {
    ($values:expr, $series:pat => $do:expr) => {
        match $values {
            Values::Boolean($series) => $do,
            Values::Single($series) => $do,
            Values::Double($series) => $do,
            Values::Int32($series) => $do,
            Values::Int64($series) => $do,
            Values::UInt32($series) => $do,
            Values::UInt64($series) => $do,
            Values::Text($series) => $do,
            Values::Numbers($series) => $do,
            Values::Texts($series) => $do,
        }
    };
    ($values:expr, $others:expr, $mine:ident, $other:ident => $do:expr, else $otherwise:expr) => {
        match ($values, $others) {
            (Values::Boolean($mine), Values::Boolean($other)) => $do,
            (Values::Single($mine), Values::Single($other)) => $do,
            (Values::Double($mine), Values::Double($other)) => $do,
            (Values::Int32($mine), Values::Int32($other)) => $do,
            (Values::Int64($mine), Values::Int64($other)) => $do,
            (Values::UInt32($mine), Values::UInt32($other)) => $do,
            (Values::UInt64($mine), Values::UInt64($other)) => $do,
            (Values::Text($mine), Values::Text($other)) => $do,
            (Values::Numbers($mine), Values::Numbers($other)) => $do,
            (Values::Texts($mine), Values::Texts($other)) => $do,
            _ => $otherwise,
        }
    };
}

impl Values {
    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        of_each_type!(self, series => series.len())
    }

    /// Whether there are no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Name of the type, as `f64`, `str`, `list[str]`.
    #[must_use]
    pub fn type_name(&self) -> &'static str {
        match self {
            Self::Boolean(_) => "bool",
            Self::Single(_) => "f32",
            Self::Double(_) => "f64",
            Self::Int32(_) => "i32",
            Self::Int64(_) => "i64",
            Self::UInt32(_) => "u32",
            Self::UInt64(_) => "u64",
            Self::Text(_) => "str",
            Self::Numbers(_) => "list[f64]",
            Self::Texts(_) => "list[str]",
        }
    }

    /// The value of every row.
    #[must_use]
    pub fn rows(&self) -> Box<dyn Iterator<Item = Value> + '_> {
        of_each_type!(self, series => Box::new(series.values()))
    }

    /// No rows yet, of the same type, with room for so many.
    pub(super) fn empty_like(&self, rows: usize) -> Self {
        of_each_type!(self, series => series.empty_like(rows).into())
    }

    /// Adds some of the rows of values of the same type; of another type there are none.
    pub(super) fn extend(&mut self, other: &Self, rows: Range<usize>) {
        of_each_type!(self, other, mine, other => mine.extend(other, rows), else ());
    }

    /// Removes all rows; the memory stays for the next ones.
    pub(super) fn clear(&mut self) {
        of_each_type!(self, series => series.clear());
    }
}

macro_rules! values_of {
    ($($series:ty => $variant:ident),* $(,)?) => {$(
        impl From<$series> for Values {
            fn from(series: $series) -> Self {
                Self::$variant(series)
            }
        }
    )*};
}

values_of!(
    Known<Vec<bool>> => Boolean,
    Known<Vec<f32>> => Single,
    Known<Vec<f64>> => Double,
    Known<Vec<i32>> => Int32,
    Known<Vec<i64>> => Int64,
    Known<Vec<u32>> => UInt32,
    Known<Vec<u64>> => UInt64,
    Known<Texts> => Text,
    Lists<Vec<f64>> => Numbers,
    Lists<Texts> => Texts,
);
