//! The columns of a table as types of the Parquet format, and the levels of their rows.
//!
//! Every column may have nulls. A row's definition level is that of a value or, where the value is missing, that of what
//! is there of it; in a list, a repetition level of 1 continues the list of the value before.

use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::errors::ParquetError;
use parquet::schema::types::{Type, TypePtr};
use polars::prelude::DataType;

use crate::tables::table::Table;

/// Definition level of a value of a column without lists; 0 is none.
pub(super) const VALUE: i16 = 1;
/// Definition level of a list without elements; 0 is no list.
pub(super) const EMPTY_LIST: i16 = 1;
/// Definition level of an element that is missing.
pub(super) const MISSING_ELEMENT: i16 = 2;
/// Definition level of an element.
pub(super) const ELEMENT: i16 = 3;

/// The schema of a table.
pub(super) fn schema(table: &Table) -> Result<TypePtr, ParquetError> {
    let columns = table.columns().iter();
    let columns = columns.map(|column| column_type(column.name(), column.series().dtype()));
    let root = Type::group_type_builder("schema").with_fields(columns.collect::<Result<_, _>>()?);
    Ok(Arc::new(root.build()?))
}

fn column_type(name: &str, kind: &DataType) -> Result<TypePtr, ParquetError> {
    let unsigned = |bits| Some(LogicalType::integer(bits, false));
    match kind {
        DataType::Boolean => leaf(name, Physical::BOOLEAN, None),
        DataType::Float32 => leaf(name, Physical::FLOAT, None),
        DataType::Float64 => leaf(name, Physical::DOUBLE, None),
        DataType::Int64 => leaf(name, Physical::INT64, None),
        DataType::UInt32 => leaf(name, Physical::INT32, unsigned(32)),
        DataType::UInt64 => leaf(name, Physical::INT64, unsigned(64)),
        DataType::String => leaf(name, Physical::BYTE_ARRAY, Some(LogicalType::String)),
        DataType::List(of) => list(name, column_type("element", of)?),
        other => Err(ParquetError::NYI(format!("columns of type {other}"))),
    }
}

fn leaf(
    name: &str,
    physical: Physical,
    logical: Option<LogicalType>,
) -> Result<TypePtr, ParquetError> {
    let leaf = Type::primitive_type_builder(name, physical)
        .with_repetition(Repetition::OPTIONAL)
        .with_logical_type(logical);
    Ok(Arc::new(leaf.build()?))
}

/// A list in the three levels that the format prescribes.
fn list(name: &str, element: TypePtr) -> Result<TypePtr, ParquetError> {
    let repeated = Type::group_type_builder("list")
        .with_repetition(Repetition::REPEATED)
        .with_fields(vec![element]);
    let list = Type::group_type_builder(name)
        .with_repetition(Repetition::OPTIONAL)
        .with_logical_type(Some(LogicalType::List))
        .with_fields(vec![Arc::new(repeated.build()?)]);
    Ok(Arc::new(list.build()?))
}
