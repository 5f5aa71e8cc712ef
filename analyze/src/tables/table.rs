//! A table: columns of equal length with names and units.

use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::Arc;

use arrow_array::types::{Float32Type, Float64Type};
use arrow_array::{Array, ArrayRef, RecordBatch};
use arrow_schema::{ArrowError, DataType, Field, Fields, Schema};

use super::cell::{self, Cell, Value};
use crate::base::options::Precision;

/// A table, or a block of rows of one.
#[derive(Debug, Clone, Default)]
pub struct Table {
    columns: Vec<Column>,
}

/// A column: name, unit, values. Times, truth values and texts may have no unit.
#[derive(Debug, Clone)]
pub struct Column {
    name: String,
    unit: Option<Cow<'static, str>>,
    values: ArrayRef,
}

impl Table {
    /// Adds a column.
    pub(crate) fn add<T: Cell>(
        &mut self,
        name: impl Into<String>,
        unit: Option<&'static str>,
        values: impl IntoIterator<Item = T>,
    ) {
        self.add_array(
            name.into(),
            unit.map(Cow::from),
            T::array(values.into_iter()),
        );
    }

    /// Adds a column of numbers, null where they are not finite or beyond the precision's range.
    pub(crate) fn add_known(
        &mut self,
        name: impl Into<String>,
        unit: &'static str,
        precision: Precision,
        values: &[f64],
    ) {
        let values = values.iter().copied();
        let known = match precision {
            Precision::Single => {
                cell::known::<Float32Type>(values.map(|value| value as f32), f32::is_finite)
            }
            Precision::Double => cell::known::<Float64Type>(values, f64::is_finite),
        };
        self.add_array(name.into(), Some(unit.into()), known);
    }

    pub(super) fn add_array(
        &mut self,
        name: String,
        unit: Option<Cow<'static, str>>,
        values: ArrayRef,
    ) {
        self.columns.push(Column { name, unit, values });
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, Column::len)
    }

    /// The columns in order.
    #[must_use]
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// The column of this name.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|column| column.name == name)
    }

    /// The table as an Arrow record batch, which shares its memory; the units are metadata (`unit`) of the fields.
    ///
    /// # Errors
    /// The columns differ in length.
    pub fn record_batch(&self) -> Result<RecordBatch, ArrowError> {
        let field = |column: &Column| {
            let field = Field::new(&column.name, column.values.data_type().clone(), true);
            let unit = column
                .unit
                .iter()
                .map(|unit| ("unit".to_string(), unit.to_string()));
            field.with_metadata(unit.collect::<HashMap<_, _>>())
        };
        let schema = Schema::new(self.columns.iter().map(field).collect::<Fields>());
        let arrays = self.columns.iter().map(|c| Arc::clone(&c.values)).collect();
        RecordBatch::try_new(Arc::new(schema), arrays)
    }

    /// Names and types of the columns.
    pub(super) fn fields(&self) -> Fields {
        let field = |c: &Column| Field::new(&c.name, c.values.data_type().clone(), true);
        self.columns.iter().map(field).collect()
    }
}

impl Column {
    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its unit; `None` for what has none.
    #[must_use]
    pub fn unit(&self) -> Option<&str> {
        self.unit.as_deref()
    }

    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Whether it has no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// Type of its values, as `f64`, `str`, `list[str]`.
    #[must_use]
    pub fn type_name(&self) -> String {
        type_name(self.values.data_type())
    }

    pub(super) fn array(&self) -> &ArrayRef {
        &self.values
    }

    /// Whether names, types and values are the same, to the bit.
    #[must_use]
    pub fn is_same(&self, other: &Self) -> bool {
        self.name == other.name && self.values.to_data() == other.values.to_data()
    }

    /// The value of every row.
    ///
    /// # Panics
    /// If the column has a type that no table of this program has.
    pub fn values(&self) -> impl Iterator<Item = Value> {
        (0..self.len()).map(|row| {
            let value = cell::value(&self.values, row);
            value.unwrap_or_else(|| panic!("{}: unexpected type {}", self.name, self.type_name()))
        })
    }

    /// Whether its numbers have 32 bits.
    #[must_use]
    pub fn is_single(&self) -> bool {
        *self.values.data_type() == DataType::Float32
    }

    /// The numbers, NaN where there is none; `None` for a column of anything but floating-point numbers.
    #[must_use]
    pub fn numbers(&self) -> Option<Vec<f64>> {
        if !matches!(
            self.values.data_type(),
            DataType::Float32 | DataType::Float64
        ) {
            return None;
        }
        let number = |value| match value {
            Value::Number(number) => number,
            _ => f64::NAN,
        };
        Some(self.values().map(number).collect())
    }

    /// The whole numbers; `None` for a column of anything else, or with nulls.
    #[must_use]
    pub fn integers(&self) -> Option<Vec<i64>> {
        let integer = |row| match cell::value(&self.values, row) {
            Some(Value::Integer(integer)) => i64::try_from(integer).ok(),
            _ => None,
        };
        (0..self.len()).map(integer).collect()
    }

    /// The whole numbers, `None` where there is none; `None` for a column of anything else.
    #[must_use]
    pub fn optional_integers(&self) -> Option<Vec<Option<i64>>> {
        let integer = |row| match cell::value(&self.values, row) {
            Some(Value::Integer(integer)) => i64::try_from(integer).ok().map(Some),
            Some(Value::Null) => Some(None),
            _ => None,
        };
        (0..self.len()).map(integer).collect()
    }

    /// The truth values; `None` for a column of anything else, or with nulls.
    #[must_use]
    pub fn booleans(&self) -> Option<Vec<bool>> {
        let boolean = |row| match cell::value(&self.values, row) {
            Some(Value::Boolean(boolean)) => Some(boolean),
            _ => None,
        };
        (0..self.len()).map(boolean).collect()
    }

    /// The texts, `None` where there is none; `None` for a column of anything else.
    #[must_use]
    pub fn texts(&self) -> Option<Vec<Option<String>>> {
        let text = |row| match cell::value(&self.values, row) {
            Some(Value::Text(text)) => Some(Some(text)),
            Some(Value::Null) => Some(None),
            _ => None,
        };
        (0..self.len()).map(text).collect()
    }
}

fn type_name(of: &DataType) -> String {
    match of {
        DataType::Boolean => "bool".into(),
        DataType::Float32 => "f32".into(),
        DataType::Float64 => "f64".into(),
        DataType::Int32 => "i32".into(),
        DataType::Int64 => "i64".into(),
        DataType::UInt32 => "u32".into(),
        DataType::UInt64 => "u64".into(),
        DataType::Utf8 | DataType::LargeUtf8 | DataType::Utf8View => "str".into(),
        DataType::List(of) | DataType::LargeList(of) => {
            format!("list[{}]", type_name(of.data_type()))
        }
        other => other.to_string(),
    }
}
