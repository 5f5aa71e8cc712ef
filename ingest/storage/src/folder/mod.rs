//! Whole objects of a folder: listed, read, written.

mod any;
mod entry;
mod expand;
mod local;
mod pattern;

pub use self::{
    any::Folder,
    entry::{Entry, Put},
    expand::{Expanded, Found, expand},
    local::UNFINISHED,
};
