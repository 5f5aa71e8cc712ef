//! Builds the columns of tables from values of Rust's types, and from columns of data frames.

use polars::prelude::{Column, DataType};

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

cells!(bool, f32, f64, i32, i64, u32, u64);

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
                    lists.push(|numbers| list.into_iter().for_each(|number| numbers.push(number)));
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

/// A column of a data frame; `None` if tables have no such type.
pub(crate) fn of_frame(column: &Column) -> Option<Values> {
    let lists = || {
        let lists = column.list().ok()?;
        Some((0..lists.len()).map(|row| lists.get_as_series(row)))
    };
    Some(match column.dtype() {
        DataType::Boolean => Cell::column(column.bool().ok()?.iter()),
        DataType::Float32 => Cell::column(column.f32().ok()?.iter()),
        DataType::Float64 => Cell::column(column.f64().ok()?.iter()),
        DataType::UInt32 => Cell::column(column.u32().ok()?.iter()),
        DataType::UInt64 => Cell::column(column.u64().ok()?.iter()),
        DataType::Int32 => Cell::column(column.i32().ok()?.iter()),
        DataType::Int64 => Cell::column(column.i64().ok()?.iter()),
        DataType::String => Cell::column(column.str().ok()?.iter()),
        DataType::List(of) if **of == DataType::Float64 => {
            Cell::column(lists()?.map(|list| Some(list?.f64().ok()?.iter().collect::<Vec<_>>())))
        }
        DataType::List(of) if **of == DataType::String => {
            let texts = lists()?.map(|list| {
                let list = list?;
                let texts = list.str().ok()?.iter();
                let texts = texts.map(|text| text.unwrap_or_default().to_owned());
                Some(texts.collect::<Vec<String>>())
            });
            Cell::column(texts)
        }
        _ => return None,
    })
}
