//! Values of a TOML file that may be written in several forms. A value in another form is refused with what was found,
//! the forms allowed, and an example, and an error inside a table or a list stays where it is.

use std::fmt;
use std::marker::PhantomData;

use serde::Deserializer;
use serde::de::{Error, MapAccess, SeqAccess, Unexpected, Visitor};

/// A value that may be written in several forms.
pub trait OneOf<'de>: Sized {
    /// The forms, with an example.
    const EXPECTED: &'static str;

    /// Creates the value from true or false, where it can be one.
    fn of_bool(_: bool) -> Option<Self> {
        None
    }

    /// Creates the value from a number, where it can be one.
    fn of_number(_: f64) -> Option<Self> {
        None
    }

    /// Creates the value from a text, where it can be one.
    fn of_text(_: &str) -> Option<Self> {
        None
    }

    /// Creates the value from a list, where it can be one.
    fn of_list<A: SeqAccess<'de>>(_: A) -> Option<Result<Self, A::Error>> {
        None
    }

    /// Creates the value from a table, where it can be one.
    fn of_table<A: MapAccess<'de>>(_: A) -> Option<Result<Self, A::Error>> {
        None
    }
}

/// Reads a value in one of its forms.
///
/// # Errors
/// The value has another form.
pub fn one_of<'de, T: OneOf<'de>, D: Deserializer<'de>>(deserializer: D) -> Result<T, D::Error> {
    deserializer.deserialize_any(Forms(PhantomData))
}

/// Lets serde read values of these types by [`one_of`](crate::machine::one_of).
#[macro_export]
macro_rules! read_one_of {
    ($($name:ident),+) => {$(
        impl<'de> serde::Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
                $crate::machine::one_of(from)
            }
        }
    )+};
}

struct Forms<T>(PhantomData<T>);

impl<'de, T: OneOf<'de>> Visitor<'de> for Forms<T> {
    type Value = T;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(T::EXPECTED)
    }

    fn visit_bool<E: Error>(self, value: bool) -> Result<T, E> {
        T::of_bool(value).ok_or_else(|| E::invalid_type(Unexpected::Bool(value), &self))
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<T, E> {
        T::of_number(value).ok_or_else(|| E::invalid_type(Unexpected::Float(value), &self))
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<T, E> {
        T::of_number(value as f64).ok_or_else(|| E::invalid_type(Unexpected::Signed(value), &self))
    }

    fn visit_str<E: Error>(self, value: &str) -> Result<T, E> {
        T::of_text(value).ok_or_else(|| E::invalid_type(Unexpected::Str(value), &self))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<T, A::Error> {
        T::of_list(list).unwrap_or_else(|| Err(A::Error::invalid_type(Unexpected::Seq, &self)))
    }

    fn visit_map<A: MapAccess<'de>>(self, table: A) -> Result<T, A::Error> {
        T::of_table(table).unwrap_or_else(|| Err(A::Error::invalid_type(Unexpected::Map, &self)))
    }
}
