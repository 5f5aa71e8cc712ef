//! Reads the metadata records of a log.

use std::collections::BTreeMap;

use crate::{
    log::Log,
    message::{Error, Extra},
};

/// A metadata record of an MCAP file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MetadataRecord {
    /// Its name.
    pub name: String,
    /// Its values by key.
    pub values: BTreeMap<String, String>,
}

/// The metadata records of a log, in file order; empty for formats without them.
///
/// # Errors
/// The log cannot be read.
pub fn metadata_records(log: &Log) -> Result<Vec<MetadataRecord>, Error> {
    let mut records = Vec::new();
    log.extras(false, &mut |extra| {
        if let Extra::Metadata(metadata) = extra {
            records.push(MetadataRecord {
                name: metadata.name,
                values: metadata.metadata,
            });
        }
    })?;
    Ok(records)
}
