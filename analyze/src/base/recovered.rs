//! Origin of a recovered log: written into the new log, and read back from it.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tipwatch_ingest::{Losses, MetadataRecord};

use super::file_hash::FileHash;

/// Name of the metadata record.
const RECORD: &str = "tipwatch_recovered_from";

/// The origin of a recovered log.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct RecoveredFrom {
    /// The files of the damaged log.
    pub files: Vec<FileHash>,
    /// Version of the program that recovered it.
    pub tipwatch_version: String,
    /// Bytes that were lost.
    pub bytes_lost: u64,
    /// The losses, as sentences.
    pub losses: Vec<String>,
}

impl RecoveredFrom {
    /// The origin of a log that is recovered from `files`.
    pub(crate) fn new(files: Vec<FileHash>, losses: &Losses) -> Self {
        Self {
            files,
            tipwatch_version: env!("CARGO_PKG_VERSION").into(),
            bytes_lost: losses.bytes_lost(),
            losses: losses.lines().collect(),
        }
    }

    /// The metadata record of the new log.
    pub(crate) fn record(&self) -> MetadataRecord {
        let mut values = BTreeMap::from([
            ("tipwatch_version".into(), self.tipwatch_version.clone()),
            ("bytes_lost".into(), self.bytes_lost.to_string()),
        ]);
        for (index, file) in self.files.iter().enumerate() {
            values.extend(file.entries(index));
        }
        for (index, loss) in self.losses.iter().enumerate() {
            values.insert(format!("loss_{index:05}"), loss.clone());
        }
        MetadataRecord {
            name: RECORD.into(),
            values,
        }
    }

    /// The origins in the metadata records of a log, the original first: a log can be recovered twice.
    pub(crate) fn all(records: &[MetadataRecord]) -> Vec<Self> {
        let ours = records.iter().filter(|record| record.name == RECORD);
        ours.map(|record| Self::read(&record.values)).collect()
    }

    fn read(values: &BTreeMap<String, String>) -> Self {
        let text = |key: &str| values.get(key).cloned().unwrap_or_default();
        let file = |index: usize| {
            Some(FileHash {
                path: values.get(&format!("file_{index}_name"))?.clone(),
                sha256: Some(text(&format!("file_{index}_sha256"))).filter(|text| text.len() == 64),
                e_tag: None,
                bytes: text(&format!("file_{index}_bytes")).parse().unwrap_or(0),
            })
        };
        let losses = values.iter().filter(|(key, _)| key.starts_with("loss_"));
        Self {
            files: (0..).map_while(file).collect(),
            tipwatch_version: text("tipwatch_version"),
            bytes_lost: text("bytes_lost").parse().unwrap_or(0),
            losses: losses.map(|(_, loss)| loss.clone()).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_origin_is_read_back_as_it_was_written() {
        let file = |path: &str| FileHash {
            path: path.into(),
            sha256: Some("ab".repeat(32)),
            e_tag: None,
            bytes: 7,
        };
        let origin = RecoveredFrom {
            files: vec![file("torn_0.mcap"), file("torn_1.mcap")],
            tipwatch_version: "0.1.0".into(),
            bytes_lost: 12,
            losses: vec!["torn_0.mcap: bytes 1 to 13".into()],
        };
        assert_eq!(RecoveredFrom::all(&[origin.record()]), [origin]);
    }
}
