//! `machine new`: a URDF, a machine file and a picture from a data sheet.

mod answers;
mod files;

pub use answers::create_from_answers;
pub use files::{LogOfMachine, NewMachine, OfLog, create};
