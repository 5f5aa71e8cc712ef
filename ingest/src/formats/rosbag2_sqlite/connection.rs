//! Opens a database for reading only.

use std::{fmt::Write as _, os::unix::ffi::OsStrExt, path::Path};

use rusqlite::{Connection, OpenFlags};

use crate::message::Error;

/// Opens without write access, and without the files that SQLite creates beside a database.
pub(super) fn connect(data: &Path, path: &Path) -> Result<Connection, Error> {
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY
        | OpenFlags::SQLITE_OPEN_URI
        | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let connection =
        Connection::open_with_flags(uri(data), flags).map_err(Error::sqlite(path, "opening"))?;
    // SQLite refuses a truncated database unless its schema is writable. Nothing can be written
    // anyway: the file is open for reading only.
    connection
        .execute_batch(
            "PRAGMA writable_schema=ON; PRAGMA trusted_schema=OFF; PRAGMA cell_size_check=ON;",
        )
        .map_err(Error::sqlite(path, "opening"))?;
    Ok(connection)
}

/// SQLite takes options only in a URI, in which every unusual byte must be escaped.
fn uri(path: &Path) -> String {
    let mut uri = String::from("file:");
    for &byte in path.as_os_str().as_bytes() {
        if byte.is_ascii_alphanumeric() || b"/-_.~".contains(&byte) {
            uri.push(char::from(byte));
        } else {
            // Writing to a string cannot fail.
            let _ = write!(uri, "%{byte:02X}");
        }
    }
    uri.push_str("?mode=ro&immutable=1");
    uri
}
