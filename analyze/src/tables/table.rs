//! A table: columns of equal length with names and units. Their values are those of polars.

use std::borrow::Cow;

use polars::prelude::{
    DataType, Float32Chunked, Float64Chunked, IntoSeries, ListBuilderTrait,
    ListStringChunkedBuilder, NewChunkedArray, PolarsResult, Series,
};

pub use polars::prelude::AnyValue as Value;

use crate::base::frame::Field;
use crate::base::options::Precision;

/// A table, or a block of rows of one.
#[derive(Debug, Clone, Default)]
pub struct Table {
    columns: Vec<Column>,
}

/// A column: name, unit, values. Times, truth values and texts may have no unit.
#[derive(Debug, Clone)]
pub struct Column {
    unit: Option<Cow<'static, str>>,
    values: Series,
}

impl FromIterator<Column> for Table {
    fn from_iter<I: IntoIterator<Item = Column>>(columns: I) -> Self {
        let columns = columns.into_iter().collect();
        Self { columns }
    }
}

impl Table {
    /// Adds a column.
    pub(crate) fn add<T: Field>(
        &mut self,
        name: impl AsRef<str>,
        unit: Option<&'static str>,
        values: impl IntoIterator<Item = T>,
    ) {
        let values: Vec<T> = values.into_iter().collect();
        let column = T::column(name.as_ref(), values.iter());
        self.add_series(unit.map(Cow::from), column.take_materialized_series());
    }

    /// Adds a column of numbers, null where they are not finite or beyond the precision's range.
    pub(crate) fn add_known(
        &mut self,
        name: impl AsRef<str>,
        unit: &'static str,
        precision: Precision,
        values: &[f64],
    ) {
        let name = name.as_ref().into();
        let known = match precision {
            Precision::Single => {
                let values = values.iter().map(|&value| value as f32);
                let known = values.map(|value| Some(value).filter(|value| value.is_finite()));
                Float32Chunked::from_iter_options(name, known).into_series()
            }
            Precision::Double if values.iter().all(|value| value.is_finite()) => {
                Float64Chunked::from_slice(name, values).into_series()
            }
            Precision::Double => {
                let known = values.iter().copied();
                let known = known.map(|value| Some(value).filter(|value| value.is_finite()));
                Float64Chunked::from_iter_options(name, known).into_series()
            }
        };
        self.add_series(Some(unit.into()), known);
    }

    /// Adds a column of lists of texts without a unit.
    pub(crate) fn add_lists<'t, L: IntoIterator<Item = &'t str>>(
        &mut self,
        name: &str,
        lists: impl ExactSizeIterator<Item = Option<L>>,
    ) {
        let rows = lists.len();
        let mut column = ListStringChunkedBuilder::new(name.into(), rows, rows);
        for list in lists {
            match list {
                Some(list) => column.append_values_iter(list.into_iter()),
                None => column.append_null(),
            }
        }
        self.add_series(None, column.finish().into_series());
    }

    /// Adds a column that polars made.
    pub(crate) fn add_series(&mut self, unit: Option<Cow<'static, str>>, values: Series) {
        self.columns.push(Column::new(unit, values));
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
        self.columns.iter().find(|column| column.name() == name)
    }

    /// Name and type of every column.
    pub(super) fn names_and_types(&self) -> impl Iterator<Item = (&str, &DataType)> {
        let columns = self.columns.iter();
        columns.map(|column| (column.name(), column.values.dtype()))
    }
}

impl Column {
    /// Values under their name, with a unit.
    #[must_use]
    pub fn new(unit: Option<Cow<'static, str>>, values: Series) -> Self {
        Self { unit, values }
    }

    /// Other values with its unit.
    #[must_use]
    pub fn with_values(&self, values: Series) -> Self {
        Self::new(self.unit.clone(), values)
    }

    /// Whether name, type and unit are the same.
    #[must_use]
    pub fn is_like(&self, other: &Self) -> bool {
        self.name() == other.name()
            && self.unit == other.unit
            && self.values.dtype() == other.values.dtype()
    }

    /// Adds the rows of another column behind those of this one.
    ///
    /// # Errors
    /// The columns have different types.
    pub fn append(&mut self, other: &Self) -> PolarsResult<()> {
        self.values.append(&other.values).map(|_| ())
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        self.values.name()
    }

    /// Its unit; `None` without one.
    #[must_use]
    pub fn unit(&self) -> Option<&str> {
        self.unit.as_deref()
    }

    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Whether the column has no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// Type of its values, as `f64`, `str`, `list[str]`.
    #[must_use]
    pub fn type_name(&self) -> String {
        self.values.dtype().to_string()
    }

    /// Its values, as polars has them.
    pub fn series(&self) -> &Series {
        &self.values
    }

    /// Whether names, types and values are the same, to the bit.
    #[must_use]
    pub fn is_same(&self, other: &Self) -> bool {
        self.name() == other.name() && is_same(&self.values, &other.values)
    }

    /// The value of every row.
    pub fn values(&self) -> impl Iterator<Item = Value<'_>> {
        (0..self.len()).map(|row| self.values.get(row).unwrap_or(Value::Null))
    }

    /// Whether the numbers of the column have 32 bits.
    #[must_use]
    pub fn is_single(&self) -> bool {
        *self.values.dtype() == DataType::Float32
    }

    /// The numbers, NaN where there is none; `None` for a column of anything but floating-point numbers.
    #[must_use]
    pub fn numbers(&self) -> Option<Vec<f64>> {
        let numbers = match self.values.dtype() {
            DataType::Float32 => self.values.cast(&DataType::Float64).ok()?,
            _ => self.values.clone(),
        };
        let numbers = numbers.f64().ok()?.iter();
        Some(numbers.map(|number| number.unwrap_or(f64::NAN)).collect())
    }

    /// The whole numbers; `None` for a column of anything else, or with nulls.
    #[must_use]
    pub fn integers(&self) -> Option<Vec<i64>> {
        self.optional_integers()?.into_iter().collect()
    }

    /// The whole numbers, `None` where there is none; `None` for a column of anything else.
    #[must_use]
    pub fn optional_integers(&self) -> Option<Vec<Option<i64>>> {
        if !self.values.dtype().is_integer() {
            return None;
        }
        let integers = self.values.strict_cast(&DataType::Int64).ok()?;
        Some(integers.i64().ok()?.iter().collect())
    }

    /// The truth values; `None` for a column of anything else, or with nulls.
    #[must_use]
    pub fn booleans(&self) -> Option<Vec<bool>> {
        self.values.bool().ok()?.iter().collect()
    }

    /// The texts, `None` where there is none; `None` for a column of anything else.
    #[must_use]
    pub fn texts(&self) -> Option<Vec<Option<String>>> {
        let texts = self.values.str().ok()?.iter();
        Some(texts.map(|text| text.map(str::to_owned)).collect())
    }
}

/// Whether types and values are the same, to the bit.
fn is_same(a: &Series, b: &Series) -> bool {
    if a.dtype() != b.dtype() || a.len() != b.len() {
        return false;
    }
    match a.dtype() {
        DataType::Float32 => match (a.f32(), b.f32()) {
            (Ok(a), Ok(b)) => {
                let bits = |number: Option<f32>| number.map(f32::to_bits);
                a.iter().map(bits).eq(b.iter().map(bits))
            }
            _ => false,
        },
        DataType::Float64 => match (a.f64(), b.f64()) {
            (Ok(a), Ok(b)) => {
                let bits = |number: Option<f64>| number.map(f64::to_bits);
                a.iter().map(bits).eq(b.iter().map(bits))
            }
            _ => false,
        },
        DataType::List(_) => match (a.list(), b.list()) {
            (Ok(a), Ok(b)) => {
                (0..a.len()).all(|row| match (a.get_as_series(row), b.get_as_series(row)) {
                    (Some(a), Some(b)) => is_same(&a, &b),
                    (a, b) => a.is_none() && b.is_none(),
                })
            }
            _ => false,
        },
        _ => a.equals_missing(b),
    }
}
