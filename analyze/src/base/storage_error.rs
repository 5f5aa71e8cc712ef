//! The error of a log, or of a bucket or server, behind an error.

use tipwatch_binding::{BindError, MachineFileError};

/// The error of opening or reading a log behind an error. Those that only pass it on are not in its own chain of causes.
#[must_use]
pub fn log_error(error: &anyhow::Error) -> Option<&tipwatch_ingest::Error> {
    error.chain().find_map(of_log)
}

fn of_log<'a>(cause: &'a (dyn std::error::Error + 'static)) -> Option<&'a tipwatch_ingest::Error> {
    let of_machine = || match cause.downcast_ref()? {
        MachineFileError::Log(error) => Some(error),
        _ => None,
    };
    let of_binding = || match cause.downcast_ref()? {
        BindError::Log(error) => Some(error),
        _ => None,
    };
    (cause.downcast_ref().or_else(of_machine)).or_else(of_binding)
}

/// The error of a bucket or server behind an error, wherever it is in its chain of causes: by itself, in an error of reading
/// a log, or in one of input and output.
#[must_use]
pub fn storage_error(error: &anyhow::Error) -> Option<&tipwatch_storage::Error> {
    error.chain().find_map(|cause| {
        let of_reading = || {
            cause
                .downcast_ref::<std::io::Error>()?
                .get_ref()?
                .downcast_ref()
        };
        let of_log = || match of_log(cause)? {
            tipwatch_ingest::Error::Storage(error) => Some(error),
            _ => None,
        };
        (cause.downcast_ref().or_else(of_reading)).or_else(of_log)
    })
}

#[cfg(test)]
mod tests {
    use tipwatch_storage::{Error, ErrorKind};

    use super::*;

    #[test]
    fn an_error_of_storage_is_found_behind_what_passes_it_on() {
        let refused = || Error {
            place: "s3://logs/a.mcap".into(),
            kind: ErrorKind::Unavailable,
            detail: "503".into(),
        };
        let of_log = || tipwatch_ingest::Error::from(refused());
        let all: [anyhow::Error; 6] = [
            refused().into(),
            of_log().into(),
            MachineFileError::from(of_log()).into(),
            BindError::from(of_log()).into(),
            std::io::Error::other(refused()).into(),
            anyhow::Error::from(of_log()).context("a log"),
        ];
        for error in &all {
            assert_eq!(storage_error(error), Some(&refused()), "{error:#}");
        }
        assert_eq!(storage_error(&anyhow::anyhow!("503")), None);
    }
}
