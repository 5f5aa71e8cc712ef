//! Values of a column: what a cell can hold when a table is built, and when it is read.

use super::series::{Known, Lists, Texts};
use super::values::Values;

/// A type that a column can be built from; an option is null where it is `None`.
pub(crate) trait Cell: Sized {
    /// The column of these values.
    fn column(values: impl Iterator<Item = Self>) -> Values;
}

macro_rules! cells {
    ($($value:ty),* $(,)?) => {$(
        impl Cell for $value {
            fn column(values: impl Iterator<Item = Self>) -> Values {
                Known::all(values.collect::<Vec<$value>>()).into()
            }
        }

        impl Cell for Option<$value> {
            fn column(values: impl Iterator<Item = Self>) -> Values {
                Known::<Vec<$value>>::collect(values).into()
            }
        }
    )*};
}

cells!(bool, f32, f64, i64, u32, u64);

impl Cell for Option<&str> {
    fn column(values: impl Iterator<Item = Self>) -> Values {
        Known::<Texts>::collect(values).into()
    }
}

impl<'a> Cell for &'a str {
    fn column(values: impl Iterator<Item = Self>) -> Values {
        Option::<&'a str>::column(values.map(Some))
    }
}

impl Cell for Option<String> {
    fn column(values: impl Iterator<Item = Self>) -> Values {
        let mut texts = Known::<Texts>::default();
        values.for_each(|value| texts.push(value.as_deref()));
        texts.into()
    }
}

impl Cell for String {
    fn column(values: impl Iterator<Item = Self>) -> Values {
        Option::<Self>::column(values.map(Some))
    }
}

impl Cell for Option<Vec<Option<f64>>> {
    fn column(values: impl Iterator<Item = Self>) -> Values {
        let mut lists = Lists::<Vec<f64>>::default();
        for list in values {
            match list {
                Some(list) => {
                    lists.push(|numbers| list.iter().for_each(|&number| numbers.push(number)))
                }
                None => lists.push_missing(),
            }
        }
        lists.into()
    }
}

impl Cell for Option<Vec<String>> {
    fn column(values: impl Iterator<Item = Self>) -> Values {
        texts(values)
    }
}

/// A column of lists of texts.
pub(crate) fn texts<T: AsRef<str>>(
    lists: impl Iterator<Item = Option<impl IntoIterator<Item = T>>>,
) -> Values {
    let mut column = Lists::<Texts>::default();
    for list in lists {
        match list {
            Some(list) => column.push(|texts| {
                list.into_iter()
                    .for_each(|text| texts.push(Some(text.as_ref())));
            }),
            None => column.push_missing(),
        }
    }
    column.into()
}

/// The value of a cell that was read.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// No value.
    Null,
    /// A truth value.
    Boolean(bool),
    /// A whole number.
    Integer(i128),
    /// A number.
    Number(f64),
    /// A text.
    Text(String),
    /// A list.
    List(Vec<Value>),
}

impl Value {
    /// Whether it is the same, numbers to the bit.
    pub(super) fn is_same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Number(a), Self::Number(b)) => a.to_bits() == b.to_bits(),
            (Self::List(a), Self::List(b)) => {
                a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.is_same(b))
            }
            _ => self == other,
        }
    }
}
