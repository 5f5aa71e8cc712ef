//! Binds a machine to a log: which topic carries which sensor.
//!
//! [`tipwatch_ingest`] knows no machine and [`tipwatch_mechanics`] opens no file; offline and live
//! analysis both need this step between them. [`MachineFile`] is read from disk. [`bind`] finds the
//! topics, checks the machine against the log and determines what to read. [`BoundLog::record`]
//! reads it.

#![forbid(unsafe_code)]

mod actuators;
mod arrivals;
mod bind;
mod bound_log;
mod can;
mod commissioning;
mod error;
mod files;
mod machine_file;
pub mod monitor_topic;
mod number_signals;
mod record;
mod sources;
mod transforms;

pub use arrivals::arrivals;
pub use bind::{bind, named_topics};
pub use bound_log::{BoundLog, BoundSensor};
pub use can::read_dbc;
pub use commissioning::{
    Commissioning, CommissioningError, CommissioningItem, CommissioningSource, NOT_COMMISSIONED,
    commissioning_of, commissioning_text,
};
pub use error::{BindError, CanError};
pub use files::{Hash, hash, hash_file, hex, program_beside, read_text, running_file, sha256};
pub use machine_file::{MachineFile, MachineFileError, Urdf};
pub use number_signals::number_field;
pub use transforms::static_transforms;
