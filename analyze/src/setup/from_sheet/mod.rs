//! `machine new`: a URDF, a machine file and a picture from a data sheet.

mod files;

pub use files::{NewMachine, create};
