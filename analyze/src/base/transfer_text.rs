//! Cost of reading a log from a bucket, as text.

use tipwatch_ingest::FileTransfer;
use tipwatch_language::say;

/// Describes the transfer of each file in a line.
pub(crate) fn lines(transfers: &[FileTransfer]) -> impl Iterator<Item = String> {
    transfers.iter().map(|transfer| {
        let FileTransfer {
            path,
            file_bytes,
            requests,
            bytes,
            ..
        } = transfer;
        let percent = 100.0 * *bytes as f64 / (*file_bytes).max(1) as f64;
        say!(
            "transferred: {}: {requests} requests, {bytes} of {file_bytes} bytes ({percent:.1} %)",
            path.display()
        )
    })
}
