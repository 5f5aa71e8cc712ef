//! Keys of objects: which of them a request can name.

use object_store::path::Path as Key;

/// Error message for every key that requests cannot name.
const EXPECTED: &str = "expected a key without empty parts (\"//\"), \".\", \"..\" and control characters, the only ones that \
                        requests can name; copy the object to such a key";

/// Returns the key that is written as this text. Of some texts the client would make another key, which may be that of another
/// object.
///
/// # Errors
/// The text has an empty part, `.`, `..` or a control character.
pub(crate) fn key_of(text: &str) -> Result<Key, &'static str> {
    match Key::parse(text) {
        Ok(key) if key.as_ref() == text => Ok(key),
        _ => Err(EXPECTED),
    }
}
