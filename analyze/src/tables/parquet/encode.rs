//! Encodes and compresses a column of a row group.

use bytes::Bytes;
use parquet::column::writer::{ColumnCloseResult, ColumnWriter, get_column_writer};
use parquet::data_type::ByteArray;
use parquet::errors::ParquetError;
use parquet::file::properties::WriterPropertiesPtr;
use parquet::file::writer::{SerializedPageWriter, TrackedWrite};
use parquet::schema::types::ColumnDescPtr;

use super::compress::{CompressingWriter, stated};
use super::schema::{ELEMENT, EMPTY_LIST, MISSING_ELEMENT, VALUE};
use crate::tables::series::{Known, Lists, Series, Texts};
use crate::tables::values::Values;

/// A column of a row group as it stands in the file, with what its end says of it.
pub(super) type Chunk = (Bytes, ColumnCloseResult);

/// Encodes and compresses the values of a column.
pub(super) fn encode(
    column: ColumnDescPtr,
    properties: WriterPropertiesPtr,
    values: &Values,
) -> Result<Chunk, ParquetError> {
    let mut pages = TrackedWrite::new(Vec::new());
    let page_writer = CompressingWriter::new(SerializedPageWriter::new(&mut pages));
    let mut writer = get_column_writer(column, properties, Box::new(page_writer));
    write(values, &mut writer)?;
    let closed = stated(writer.close()?)?;
    Ok((pages.into_inner()?.into(), closed))
}

fn write(values: &Values, writer: &mut ColumnWriter<'_>) -> Result<usize, ParquetError> {
    use ColumnWriter::{
        BoolColumnWriter, ByteArrayColumnWriter, DoubleColumnWriter, FloatColumnWriter,
        Int32ColumnWriter, Int64ColumnWriter,
    };
    match (values, writer) {
        (Values::Boolean(of), BoolColumnWriter(to)) => {
            to.write_batch(of.known(), Some(&levels(of)), None)
        }
        (Values::Single(of), FloatColumnWriter(to)) => {
            to.write_batch(of.known(), Some(&levels(of)), None)
        }
        (Values::Double(of), DoubleColumnWriter(to)) => {
            to.write_batch(of.known(), Some(&levels(of)), None)
        }
        (Values::Int32(of), Int32ColumnWriter(to)) => {
            to.write_batch(of.known(), Some(&levels(of)), None)
        }
        (Values::Int64(of), Int64ColumnWriter(to)) => {
            to.write_batch(of.known(), Some(&levels(of)), None)
        }
        // the format keeps the bits of counts in whole numbers with a sign
        (Values::UInt32(of), Int32ColumnWriter(to)) => {
            let signed = of.known().iter().map(|count| count.cast_signed());
            to.write_batch(&signed.collect::<Vec<_>>(), Some(&levels(of)), None)
        }
        (Values::UInt64(of), Int64ColumnWriter(to)) => {
            let signed = of.known().iter().map(|count| count.cast_signed());
            to.write_batch(&signed.collect::<Vec<_>>(), Some(&levels(of)), None)
        }
        (Values::Text(of), ByteArrayColumnWriter(to)) => {
            to.write_batch(&byte_arrays(of.known()), Some(&levels(of)), None)
        }
        (Values::Numbers(of), DoubleColumnWriter(to)) => {
            let (definition, repetition) = levels_of_lists(of);
            let numbers = of.elements().known();
            to.write_batch(numbers, Some(&definition), Some(&repetition))
        }
        (Values::Texts(of), ByteArrayColumnWriter(to)) => {
            let (definition, repetition) = levels_of_lists(of);
            let texts = byte_arrays(of.elements().known());
            to.write_batch(&texts, Some(&definition), Some(&repetition))
        }
        _ => Err(ParquetError::General(format!(
            "expected a column of another type than {}",
            values.type_name()
        ))),
    }
}

/// Definition levels.
fn levels<S: Series>(of: &Known<S>) -> Vec<i16> {
    match of.is_known() {
        Some(is_known) => is_known
            .iter()
            .map(|&known| VALUE * i16::from(known))
            .collect(),
        None => vec![VALUE; of.len()],
    }
}

/// Definition and repetition levels.
fn levels_of_lists<S: Series>(of: &Lists<S>) -> (Vec<i16>, Vec<i16>) {
    let (mut definition, mut repetition) = (Vec::new(), Vec::new());
    for list in of.rows() {
        let is_list = list.is_some();
        let elements = list.unwrap_or_default();
        if elements.is_empty() {
            definition.push(if is_list { EMPTY_LIST } else { 0 });
            repetition.push(0);
        }
        for (place, element) in elements.into_iter().enumerate() {
            definition.push(element.map_or(MISSING_ELEMENT, |_| ELEMENT));
            repetition.push(i16::from(place > 0));
        }
    }
    (definition, repetition)
}

/// The texts, which share the memory of a copy.
fn byte_arrays(of: &Texts) -> Vec<ByteArray> {
    let (joined, places) = of.places();
    let joined = Bytes::copy_from_slice(joined.as_bytes());
    places.map(|place| joined.slice(place).into()).collect()
}
