//! Values of a column: what a cell can hold when a table is built, and when it is read.

use std::sync::Arc;

use arrow_array::builder::{
    BooleanBuilder, Float64Builder, ListBuilder, PrimitiveBuilder, StringBuilder,
};
use arrow_array::cast::AsArray;
use arrow_array::types::{Float32Type, Float64Type, Int32Type, Int64Type, UInt32Type, UInt64Type};
use arrow_array::{Array, ArrayRef, ArrowPrimitiveType, PrimitiveArray};
use arrow_schema::{DataType, Field};

/// A type that a column can be built from; an option is null where it is `None`.
pub(crate) trait Cell: Sized {
    /// The column of these values.
    fn array(values: impl Iterator<Item = Self>) -> ArrayRef;
}

macro_rules! cells {
    ($($value:ty => $builder:ty),* $(,)?) => {$(
        impl Cell for $value {
            fn array(values: impl Iterator<Item = Self>) -> ArrayRef {
                Option::<$value>::array(values.map(Some))
            }
        }

        impl Cell for Option<$value> {
            fn array(values: impl Iterator<Item = Self>) -> ArrayRef {
                let mut builder = <$builder>::with_capacity(values.size_hint().0);
                for value in values {
                    builder.append_option(value);
                }
                Arc::new(builder.finish())
            }
        }
    )*};
}

cells!(
    bool => BooleanBuilder,
    f32 => PrimitiveBuilder<Float32Type>,
    f64 => PrimitiveBuilder<Float64Type>,
    i64 => PrimitiveBuilder<Int64Type>,
    u32 => PrimitiveBuilder<UInt32Type>,
    u64 => PrimitiveBuilder<UInt64Type>,
);

impl Cell for Option<&str> {
    fn array(values: impl Iterator<Item = Self>) -> ArrayRef {
        let mut builder = StringBuilder::new();
        for value in values {
            builder.append_option(value);
        }
        Arc::new(builder.finish())
    }
}

impl<'a> Cell for &'a str {
    fn array(values: impl Iterator<Item = Self>) -> ArrayRef {
        Option::<&'a str>::array(values.map(Some))
    }
}

impl Cell for Option<String> {
    fn array(values: impl Iterator<Item = Self>) -> ArrayRef {
        let mut builder = StringBuilder::new();
        for value in values {
            builder.append_option(value);
        }
        Arc::new(builder.finish())
    }
}

impl Cell for String {
    fn array(values: impl Iterator<Item = Self>) -> ArrayRef {
        Option::<Self>::array(values.map(Some))
    }
}

impl Cell for Option<Vec<Option<f64>>> {
    fn array(values: impl Iterator<Item = Self>) -> ArrayRef {
        let mut builder = ListBuilder::new(Float64Builder::new()).with_field(element::<f64>());
        for list in values {
            builder.append_option(list);
        }
        Arc::new(builder.finish())
    }
}

impl Cell for Option<Vec<String>> {
    fn array(values: impl Iterator<Item = Self>) -> ArrayRef {
        texts(values)
    }
}

/// A column of numbers, null where they are not finite.
pub(super) fn known<T: ArrowPrimitiveType>(
    values: impl Iterator<Item = T::Native>,
    is_finite: impl Fn(T::Native) -> bool,
) -> ArrayRef {
    let values: Vec<T::Native> = values.collect();
    let all_known = values.iter().all(|&value| is_finite(value));
    let known = || -> Vec<bool> { values.iter().map(|&value| is_finite(value)).collect() };
    let known = (!all_known).then(|| known().into());
    Arc::new(PrimitiveArray::<T>::new(values.into(), known))
}

/// A column of lists of texts.
pub(crate) fn texts<T: AsRef<str>>(
    lists: impl Iterator<Item = Option<impl IntoIterator<Item = T>>>,
) -> ArrayRef {
    let mut builder = ListBuilder::new(StringBuilder::new()).with_field(element::<String>());
    for list in lists {
        builder.append_option(list.map(|list| list.into_iter().map(Some)));
    }
    Arc::new(builder.finish())
}

/// The elements of a list, by the name that the Parquet format prescribes.
fn element<T: Cell>() -> Field {
    let none = T::array(std::iter::empty());
    Field::new("element", none.data_type().clone(), true)
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

/// The value of a row; `None` for types that no table of ours has.
pub(super) fn value(array: &dyn Array, row: usize) -> Option<Value> {
    if array.is_null(row) {
        return Some(Value::Null);
    }
    Some(match array.data_type() {
        DataType::Boolean => Value::Boolean(array.as_boolean().value(row)),
        DataType::Float32 => Value::Number(array.as_primitive::<Float32Type>().value(row).into()),
        DataType::Float64 => Value::Number(array.as_primitive::<Float64Type>().value(row)),
        DataType::Int32 => Value::Integer(array.as_primitive::<Int32Type>().value(row).into()),
        DataType::Int64 => Value::Integer(array.as_primitive::<Int64Type>().value(row).into()),
        DataType::UInt32 => Value::Integer(array.as_primitive::<UInt32Type>().value(row).into()),
        DataType::UInt64 => Value::Integer(array.as_primitive::<UInt64Type>().value(row).into()),
        DataType::Utf8 => Value::Text(array.as_string::<i32>().value(row).to_string()),
        DataType::LargeUtf8 => Value::Text(array.as_string::<i64>().value(row).to_string()),
        DataType::Utf8View => Value::Text(array.as_string_view().value(row).to_string()),
        DataType::List(_) => elements(&array.as_list::<i32>().value(row))?,
        DataType::LargeList(_) => elements(&array.as_list::<i64>().value(row))?,
        _ => return None,
    })
}

fn elements(list: &ArrayRef) -> Option<Value> {
    let elements: Option<Vec<Value>> = (0..list.len()).map(|at| value(list, at)).collect();
    elements.map(Value::List)
}
