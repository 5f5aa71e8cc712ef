//! Records as data frames: a struct whose fields are the columns of a table.
//!
//! `record!` declares such a struct once; a pair of records has the columns of both. Its fields, types, units and comments are the
//! columns of the Parquet files, and the reference page is written from them.

use polars::prelude::{
    BooleanChunked, Column, DataFrame, DataType, Float64Chunked, Float64Type, Int32Chunked,
    Int64Chunked, IntoColumn, IntoSeries, ListBuilderTrait, ListPrimitiveChunkedBuilder,
    ListStringChunkedBuilder, NamedFrom, NewChunkedArray, PolarsResult, Series, StringChunked,
    UInt32Chunked, UInt64Chunked,
};

use super::shared::Shared;

/// A column as its record declares it.
#[derive(Debug, Clone, Copy)]
pub struct ColumnInfo {
    /// Its name.
    pub name: &'static str,
    /// Its unit; `None` without one.
    pub unit: Option<&'static str>,
    /// Type of its values.
    pub type_name: &'static str,
    /// Meaning of the values, line by line.
    pub meaning: &'static [&'static str],
}

/// A struct whose fields are the columns of a table.
pub trait Record: Sized {
    /// The columns in order.
    fn columns() -> Vec<ColumnInfo>;

    /// The table of some records.
    ///
    /// # Errors
    /// The table would be too large.
    fn frame<'a>(
        records: impl ExactSizeIterator<Item = &'a Self> + Clone,
    ) -> PolarsResult<DataFrame>
    where
        Self: 'a;

    /// The columns with a unit, as pairs of name and unit in JSON.
    #[must_use]
    fn units() -> String {
        let units = Self::columns().into_iter();
        let units: serde_json::Map<String, serde_json::Value> = units
            .filter_map(|column| Some((column.name.to_owned(), column.unit?.into())))
            .collect();
        serde_json::Value::Object(units).to_string()
    }
}

/// One beside the other.
impl<A: Record, B: Record> Record for (A, &B) {
    fn columns() -> Vec<ColumnInfo> {
        [A::columns(), B::columns()].concat()
    }

    fn frame<'a>(
        records: impl ExactSizeIterator<Item = &'a Self> + Clone,
    ) -> PolarsResult<DataFrame>
    where
        Self: 'a,
    {
        let first = A::frame(records.clone().map(|(a, _)| a))?;
        let second = B::frame(records.map(|(_, b)| *b))?;
        first.hstack(second.columns())
    }
}

/// A day, as the number of days since 1970-01-01.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Day(pub i32);

impl Day {
    /// Formats the day as text, such as `2026-06-01`; `None` beyond the calendar.
    #[must_use]
    pub fn date(self) -> Option<String> {
        let first = jiff::civil::date(1970, 1, 1);
        let date = first.checked_add(jiff::Span::new().try_days(self.0).ok()?);
        date.ok().map(|date| date.to_string())
    }
}

/// The type of a field: the column that holds its values. All columns may have nulls.
pub trait Field: Sized {
    /// Name of the column's type.
    const TYPE: &'static str;

    /// The column of these values.
    fn column<'a>(name: &str, values: impl ExactSizeIterator<Item = &'a Self>) -> Column
    where
        Self: 'a;
}

macro_rules! fields_of {
    ($($value:ty => $column:ty, $name:literal;)*) => {$(
        impl Field for $value {
            const TYPE: &'static str = $name;

            fn column<'a>(name: &str, values: impl ExactSizeIterator<Item = &'a Self>) -> Column {
                <$column>::from_iter_values(name.into(), values.copied()).into_column()
            }
        }

        impl Field for Option<$value> {
            const TYPE: &'static str = $name;

            fn column<'a>(name: &str, values: impl ExactSizeIterator<Item = &'a Self>) -> Column {
                <$column>::from_iter_options(name.into(), values.copied()).into_column()
            }
        }
    )*};
}

fields_of! {
    f64 => Float64Chunked, "f64";
    i64 => Int64Chunked, "i64";
    u32 => UInt32Chunked, "u32";
    u64 => UInt64Chunked, "u64";
}

impl Field for bool {
    const TYPE: &'static str = "bool";

    fn column<'a>(name: &str, values: impl ExactSizeIterator<Item = &'a Self>) -> Column {
        Series::new(name.into(), values.copied().collect::<Vec<bool>>()).into_column()
    }
}

impl Field for Option<bool> {
    const TYPE: &'static str = "bool";

    fn column<'a>(name: &str, values: impl ExactSizeIterator<Item = &'a Self>) -> Column {
        let column: BooleanChunked = values.copied().collect();
        column.with_name(name.into()).into_column()
    }
}

impl Field for String {
    const TYPE: &'static str = "str";

    fn column<'a>(name: &str, values: impl ExactSizeIterator<Item = &'a Self>) -> Column {
        StringChunked::from_iter_values(name.into(), values.map(String::as_str)).into_column()
    }
}

impl Field for Option<String> {
    const TYPE: &'static str = "str";

    fn column<'a>(name: &str, values: impl ExactSizeIterator<Item = &'a Self>) -> Column {
        StringChunked::from_iter_options(name.into(), values.map(Option::as_deref)).into_column()
    }
}

impl Field for Shared<str> {
    const TYPE: &'static str = "str";

    fn column<'a>(name: &str, values: impl ExactSizeIterator<Item = &'a Self>) -> Column {
        StringChunked::from_iter_values(name.into(), values.map(|text| &**text)).into_column()
    }
}

impl Field for Option<Shared<str>> {
    const TYPE: &'static str = "str";

    fn column<'a>(name: &str, values: impl ExactSizeIterator<Item = &'a Self>) -> Column {
        StringChunked::from_iter_options(name.into(), values.map(Option::as_deref)).into_column()
    }
}

impl Field for &str {
    const TYPE: &'static str = "str";

    fn column<'a>(name: &str, values: impl ExactSizeIterator<Item = &'a Self>) -> Column
    where
        Self: 'a,
    {
        StringChunked::from_iter_values(name.into(), values.copied()).into_column()
    }
}

impl Field for Option<&str> {
    const TYPE: &'static str = "str";

    fn column<'a>(name: &str, values: impl ExactSizeIterator<Item = &'a Self>) -> Column
    where
        Self: 'a,
    {
        StringChunked::from_iter_options(name.into(), values.copied()).into_column()
    }
}

impl Field for Option<Day> {
    const TYPE: &'static str = "date";

    fn column<'a>(name: &str, values: impl ExactSizeIterator<Item = &'a Self>) -> Column {
        let days = values.map(|day| day.map(|Day(day)| day));
        let days = Int32Chunked::from_iter_options(name.into(), days);
        days.into_date().into_column()
    }
}

impl Field for Option<Vec<Option<f64>>> {
    const TYPE: &'static str = "list[f64]";

    fn column<'a>(name: &str, values: impl ExactSizeIterator<Item = &'a Self>) -> Column {
        let rows = values.len();
        let mut lists = ListPrimitiveChunkedBuilder::<Float64Type>::new(
            name.into(),
            rows,
            4 * rows,
            DataType::Float64,
        );
        for list in values {
            match list {
                Some(list) => lists.append_iter(list.iter().copied()),
                None => lists.append_null(),
            }
        }
        lists.finish().into_series().into_column()
    }
}

impl Field for Option<Vec<String>> {
    const TYPE: &'static str = "list[str]";

    fn column<'a>(name: &str, values: impl ExactSizeIterator<Item = &'a Self>) -> Column {
        let rows = values.len();
        let mut lists = ListStringChunkedBuilder::new(name.into(), rows, 4 * rows);
        for list in values {
            match list {
                Some(list) => lists.append_values_iter(list.iter().map(String::as_str)),
                None => lists.append_null(),
            }
        }
        lists.finish().into_series().into_column()
    }
}

/// Declares a [`Record`]: its comments are the meanings of the columns, and a unit may follow a type in brackets. With
/// `of (arguments) { statements }` after its name, the value of each column follows, and `of` makes the record of them.
macro_rules! record {
    ($(#[$about:meta])* $visible:vis struct $name:ident {
        $($(#[doc = $meaning:literal])+ $field:ident: $type:ty $([$unit:literal])?,)+
    }) => {
        #[derive(Debug, Clone, PartialEq)]
        $(#[$about])*
        $visible struct $name {
            $($(#[doc = $meaning])+ $visible $field: $type,)+
        }

        impl $crate::base::frame::Record for $name {
            fn columns() -> Vec<$crate::base::frame::ColumnInfo> {
                vec![$($crate::base::frame::ColumnInfo {
                    name: stringify!($field),
                    unit: $crate::base::frame::record!(@unit $($unit)?),
                    type_name: <$type as $crate::base::frame::Field>::TYPE,
                    meaning: &[$($meaning),+],
                },)+]
            }

            fn frame<'a>(
                records: impl ExactSizeIterator<Item = &'a Self> + Clone,
            ) -> polars::prelude::PolarsResult<polars::prelude::DataFrame> {
                let columns = vec![$(<$type as $crate::base::frame::Field>::column(
                    stringify!($field),
                    records.clone().map(|record| &record.$field),
                ),)+];
                polars::prelude::DataFrame::new(records.len(), columns)
            }
        }
    };
    ($(#[$about:meta])* $visible:vis struct $name:ident of $arguments:tt { $($statements:tt)* } {
        $($(#[doc = $meaning:literal])+ $field:ident: $type:ty $([$unit:literal])? = $value:expr,)+
    }) => {
        $crate::base::frame::record! {
            $(#[$about])* $visible struct $name {
                $($(#[doc = $meaning])+ $field: $type $([$unit])?,)+
            }
        }

        impl $name {
            /// Makes it: each column has the value that is declared beside it.
            #[must_use]
            $visible fn of $arguments -> Self {
                $($statements)*
                Self { $($field: $value,)+ }
            }
        }
    };
    (@unit) => { None };
    (@unit $unit:literal) => { Some($unit) };
}

pub(crate) use record;
