//! Keys of objects: which of them a request can name.

use object_store::path::Path as Key;

/// What is wrong with any other key.
const EXPECTED: &str = "expected a key without empty parts (\"//\"), \".\", \"..\" and control characters, the only ones that \
                        requests can name; copy the object to such a key";

/// The key that is written as this text. Of some texts the client would make another key, which may be that of another object.
///
/// # Errors
/// It has an empty part, `.`, `..` or a control character.
pub(crate) fn key_of(text: &str) -> Result<Key, &'static str> {
    match Key::parse(text) {
        Ok(key) if key.as_ref() == text => Ok(key),
        _ => Err(EXPECTED),
    }
}
