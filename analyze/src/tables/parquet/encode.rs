//! Encodes and compresses a column of a row group.

use bytes::Bytes;
use parquet::column::writer::{ColumnCloseResult, ColumnWriter, get_column_writer};
use parquet::data_type::ByteArray;
use parquet::errors::ParquetError;
use parquet::file::properties::WriterPropertiesPtr;
use parquet::file::writer::{SerializedPageWriter, TrackedWrite};
use parquet::schema::types::ColumnDescPtr;
use polars::prelude::{ChunkedArray, PolarsError, PolarsNumericType, Series};

use super::compress::{CompressingWriter, stated};
use super::schema::{ELEMENT, EMPTY_LIST, MISSING_ELEMENT, VALUE};

/// A column of a row group as it stands in the file, with the metadata from its end.
pub(super) type Chunk = (Bytes, ColumnCloseResult);

/// Encodes and compresses the values of a column.
pub(super) fn encode(
    column: ColumnDescPtr,
    properties: WriterPropertiesPtr,
    values: &Series,
) -> Result<Chunk, ParquetError> {
    let mut pages = TrackedWrite::new(Vec::new());
    let page_writer = CompressingWriter::new(SerializedPageWriter::new(&mut pages));
    let mut writer = get_column_writer(column, properties, Box::new(page_writer));
    write(values, &mut writer)?;
    let closed = stated(writer.close()?)?;
    Ok((pages.into_inner()?.into(), closed))
}

fn write(values: &Series, writer: &mut ColumnWriter<'_>) -> Result<usize, ParquetError> {
    let failed = |error: PolarsError| ParquetError::External(Box::new(error));
    match writer {
        ColumnWriter::BoolColumnWriter(to) => {
            let (known, levels) = known(values.bool().map_err(failed)?.iter());
            to.write_batch(&known, Some(&levels), None)
        }
        ColumnWriter::FloatColumnWriter(to) => {
            let (known, levels) = known_numbers(values.f32().map_err(failed)?);
            to.write_batch(&known, Some(&levels), None)
        }
        ColumnWriter::DoubleColumnWriter(to) => match values.list() {
            Ok(lists) => {
                let mut of = Elements::default();
                for list in lists.amortized_iter() {
                    match list {
                        Some(list) => of.add(list.as_ref().f64().map_err(failed)?.iter()),
                        None => of.add_none(),
                    }
                }
                to.write_batch(&of.known, Some(&of.definition), Some(&of.repetition))
            }
            Err(_) => {
                let (known, levels) = known_numbers(values.f64().map_err(failed)?);
                to.write_batch(&known, Some(&levels), None)
            }
        },
        // the format keeps the bits of counts in whole numbers with a sign
        ColumnWriter::Int32ColumnWriter(to) => {
            let counts = values.u32().map_err(failed)?.iter();
            let (known, levels) = known(counts.map(|count| count.map(u32::cast_signed)));
            to.write_batch(&known, Some(&levels), None)
        }
        ColumnWriter::Int64ColumnWriter(to) => {
            let (known, levels) = match values.u64() {
                Ok(counts) => known(counts.iter().map(|count| count.map(u64::cast_signed))),
                Err(_) => known_numbers(values.i64().map_err(failed)?),
            };
            to.write_batch(&known, Some(&levels), None)
        }
        ColumnWriter::ByteArrayColumnWriter(to) => match values.list() {
            Ok(lists) => {
                let mut of = Elements::default();
                for list in lists.amortized_iter() {
                    match list {
                        Some(list) => {
                            let texts = list.as_ref().str().map_err(failed)?.iter();
                            of.add(texts.map(|text| text.map(ByteArray::from)));
                        }
                        None => of.add_none(),
                    }
                }
                to.write_batch(&of.known, Some(&of.definition), Some(&of.repetition))
            }
            Err(_) => {
                let (known, levels) = known(values.str().map_err(failed)?.iter());
                to.write_batch(&byte_arrays(&known), Some(&levels), None)
            }
        },
        _ => Err(ParquetError::NYI(format!(
            "columns of type {}",
            values.dtype()
        ))),
    }
}

/// The texts, which share the memory of a copy.
fn byte_arrays(texts: &[&str]) -> Vec<ByteArray> {
    let joined = Bytes::from(texts.concat());
    let places = texts.iter().scan(0, |end, text| {
        let start = *end;
        *end += text.len();
        Some(start..*end)
    });
    places.map(|place| joined.slice(place).into()).collect()
}

/// The values that are known, and the definition levels of all.
fn known<T>(values: impl Iterator<Item = Option<T>>) -> (Vec<T>, Vec<i16>) {
    let mut levels = Vec::with_capacity(values.size_hint().0);
    let known = values.inspect(|value| levels.push(VALUE * i16::from(value.is_some())));
    (known.flatten().collect(), levels)
}

/// Returns the known values and the definition levels of numbers; those of a column without missing numbers are copied as a
/// whole.
fn known_numbers<T: PolarsNumericType>(values: &ChunkedArray<T>) -> (Vec<T::Native>, Vec<i16>) {
    if values.has_nulls() {
        return known(values.iter());
    }
    let all: Vec<T::Native> = values.data_views().flatten().copied().collect();
    let levels = vec![VALUE; all.len()];
    (all, levels)
}

/// The elements of lists that are known, with the levels of all.
#[derive(Default)]
struct Elements<T> {
    known: Vec<T>,
    definition: Vec<i16>,
    repetition: Vec<i16>,
}

impl<T> Elements<T> {
    fn add(&mut self, list: impl Iterator<Item = Option<T>>) {
        let before = self.definition.len();
        for element in list {
            let level = if element.is_some() {
                ELEMENT
            } else {
                MISSING_ELEMENT
            };
            self.definition.push(level);
            self.repetition
                .push(i16::from(self.definition.len() > before + 1));
            self.known.extend(element);
        }
        if self.definition.len() == before {
            self.definition.push(EMPTY_LIST);
            self.repetition.push(0);
        }
    }

    fn add_none(&mut self) {
        self.definition.push(0);
        self.repetition.push(0);
    }
}
