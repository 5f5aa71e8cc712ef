//! A table: columns of equal length with names and units.

use std::borrow::Cow;

use super::cell::Value;
use super::collect::Cell;
use super::series::Known;
use super::values::Values;
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
    values: Values,
}

impl Table {
    /// Adds a column.
    pub(crate) fn add<T: Cell>(
        &mut self,
        name: impl Into<String>,
        unit: Option<&'static str>,
        values: impl IntoIterator<Item = T>,
    ) {
        self.add_values(name, unit.map(Cow::from), T::column(values.into_iter()));
    }

    /// Adds a column of numbers, null where they are not finite or beyond the precision's range.
    pub(crate) fn add_known(
        &mut self,
        name: impl Into<String>,
        unit: &'static str,
        precision: Precision,
        values: &[f64],
    ) {
        let known: Values = match precision {
            Precision::Single => {
                let values = values.iter().map(|&value| value as f32).collect();
                Known::where_known(values, f32::is_finite).into()
            }
            Precision::Double => Known::where_known(values.to_vec(), f64::is_finite).into(),
        };
        self.add_values(name, Some(unit.into()), known);
    }

    pub(crate) fn add_values(
        &mut self,
        name: impl Into<String>,
        unit: Option<Cow<'static, str>>,
        values: Values,
    ) {
        let name = name.into();
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

    /// The columns, each of which gives its values away.
    pub fn into_columns(self) -> impl Iterator<Item = Column> {
        self.columns.into_iter()
    }

    /// The column of this name.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|column| column.name == name)
    }

    /// Name and type of every column.
    pub(super) fn names_and_types(&self) -> impl Iterator<Item = (&str, &'static str)> {
        let columns = self.columns.iter();
        columns.map(|column| (column.name(), column.type_name()))
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
    pub fn type_name(&self) -> &'static str {
        self.values.type_name()
    }

    /// Its values, by type.
    #[must_use]
    pub fn typed(&self) -> &Values {
        &self.values
    }

    /// The same, of a column that is no longer needed.
    #[must_use]
    pub fn into_values(self) -> Values {
        self.values
    }

    /// Whether names, types and values are the same, to the bit.
    #[must_use]
    pub fn is_same(&self, other: &Self) -> bool {
        self.name == other.name
            && self.type_name() == other.type_name()
            && self.len() == other.len()
            && self
                .values()
                .zip(other.values())
                .all(|(a, b)| a.is_same(&b))
    }

    /// The value of every row.
    pub fn values(&self) -> impl Iterator<Item = Value> {
        self.values.rows()
    }

    /// Whether its numbers have 32 bits.
    #[must_use]
    pub fn is_single(&self) -> bool {
        matches!(self.values, Values::Single(_))
    }

    /// The numbers, NaN where there is none; `None` for a column of anything but floating-point numbers.
    #[must_use]
    pub fn numbers(&self) -> Option<Vec<f64>> {
        match &self.values {
            Values::Single(numbers) => Some(
                numbers
                    .rows()
                    .map(|number| number.map_or(f64::NAN, f64::from))
                    .collect(),
            ),
            Values::Double(numbers) => Some(
                numbers
                    .rows()
                    .map(|number| number.unwrap_or(f64::NAN))
                    .collect(),
            ),
            _ => None,
        }
    }

    /// The whole numbers; `None` for a column of anything else, or with nulls.
    #[must_use]
    pub fn integers(&self) -> Option<Vec<i64>> {
        let integer = |value| match value {
            Value::Integer(integer) => i64::try_from(integer).ok(),
            _ => None,
        };
        self.values().map(integer).collect()
    }

    /// The whole numbers, `None` where there is none; `None` for a column of anything else.
    #[must_use]
    pub fn optional_integers(&self) -> Option<Vec<Option<i64>>> {
        let integer = |value| match value {
            Value::Integer(integer) => i64::try_from(integer).ok().map(Some),
            Value::Null => Some(None),
            _ => None,
        };
        self.values().map(integer).collect()
    }

    /// The truth values; `None` for a column of anything else, or with nulls.
    #[must_use]
    pub fn booleans(&self) -> Option<Vec<bool>> {
        let boolean = |value| match value {
            Value::Boolean(boolean) => Some(boolean),
            _ => None,
        };
        self.values().map(boolean).collect()
    }

    /// The texts, `None` where there is none; `None` for a column of anything else.
    #[must_use]
    pub fn texts(&self) -> Option<Vec<Option<String>>> {
        let text = |value| match value {
            Value::Text(text) => Some(Some(text)),
            Value::Null => Some(None),
            _ => None,
        };
        self.values().map(text).collect()
    }
}
