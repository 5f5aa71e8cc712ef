//! The values of a column as an Arrow array.

use std::sync::Arc;

use arrow_array::builder::{Float64Builder, ListBuilder, StringBuilder};
use arrow_array::types::{Float32Type, Float64Type, Int32Type, Int64Type, UInt32Type, UInt64Type};
use arrow_array::{ArrayRef, ArrowPrimitiveType, BooleanArray, PrimitiveArray, StringArray};
use arrow_schema::Field;
use tipwatch_analyze::tables::series::{Known, Series};
use tipwatch_analyze::tables::values::Values;

/// The values of a column; numbers of which none is missing keep their memory.
pub(crate) fn array(values: Values) -> ArrayRef {
    match values {
        Values::Boolean(known) => Arc::new(BooleanArray::from_iter(known.rows())),
        Values::Single(known) => numbers::<Float32Type>(known),
        Values::Double(known) => numbers::<Float64Type>(known),
        Values::Int32(known) => numbers::<Int32Type>(known),
        Values::Int64(known) => numbers::<Int64Type>(known),
        Values::UInt32(known) => numbers::<UInt32Type>(known),
        Values::UInt64(known) => numbers::<UInt64Type>(known),
        Values::Text(known) => Arc::new(StringArray::from_iter(known.rows())),
        Values::Numbers(lists) => {
            let element = Field::new(ELEMENT, arrow_schema::DataType::Float64, true);
            let mut builder = ListBuilder::new(Float64Builder::new()).with_field(element);
            lists.rows().for_each(|row| builder.append_option(row));
            Arc::new(builder.finish())
        }
        Values::Texts(lists) => {
            let element = Field::new(ELEMENT, arrow_schema::DataType::Utf8, true);
            let mut builder = ListBuilder::new(StringBuilder::new()).with_field(element);
            lists.rows().for_each(|row| builder.append_option(row));
            Arc::new(builder.finish())
        }
    }
}

/// Name of the elements of a list, as in the files.
const ELEMENT: &str = "element";

fn numbers<T: ArrowPrimitiveType>(known: Known<Vec<T::Native>>) -> ArrayRef
where
    Vec<T::Native>: for<'a> Series<Item<'a> = T::Native>,
{
    match known.into_all() {
        Ok(values) => Arc::new(PrimitiveArray::<T>::new(values.into(), None)),
        Err(known) => Arc::new(PrimitiveArray::<T>::from_iter(known.rows())),
    }
}
