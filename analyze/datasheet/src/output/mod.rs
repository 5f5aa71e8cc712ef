//! Outputs of a machine: URDF, machine file, picture, summary.

mod machine_file;
mod picture;
mod project;
mod summary;
mod supports;
mod text;
mod urdf;

pub use machine_file::FromLog;
pub use text::{comment, quoted};
