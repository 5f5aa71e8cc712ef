//! Lists of a fixed length. The reader of TOML takes the first values of a longer list, and says nothing of the rest.

use serde::de::Error;
use serde::{Deserialize, Deserializer};

/// Reads a list of exactly `N` values.
///
/// # Errors
/// There are more or fewer, or one is not a `T`.
pub fn exactly<'de, T: Deserialize<'de>, const N: usize, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<[T; N], D::Error> {
    let list = Vec::<T>::deserialize(deserializer)?;
    let found = list.len();
    let expected = format!("a list of {N} values");
    let array = list.try_into();
    array.map_err(|_| D::Error::invalid_length(found, &expected.as_str()))
}

/// Reads a list of exactly `N` values for a key that may be left out.
///
/// # Errors
/// There are more or fewer values, or one is not a `T`.
pub fn exactly_if_any<'de, T: Deserialize<'de>, const N: usize, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<[T; N]>, D::Error> {
    exactly(deserializer).map(Some)
}
