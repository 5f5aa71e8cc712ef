//! Wire format: message types, their names and hashes, and their conversion from and to the types of mechanics. [`contract`]
//! lists services and enumerations; [`c_header`] generates the same for C.

pub mod c_header;
pub mod command;
pub mod contract;
pub mod fingerprint;
mod hash;
pub mod identity;
mod message;
pub mod names;
pub mod opening;
pub mod prediction_text;
pub mod refusal;
pub mod sample;
pub mod session;
pub mod topics;
pub mod verdict;
