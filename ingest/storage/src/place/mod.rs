//! Location of places and access to them: their names, their stores, their credentials.

mod access;
mod known;
mod location;

pub use self::{
    access::Access,
    known::{connect, set_whole_reads, whole_reads},
    location::Location,
};
pub(crate) use self::{
    known::{Kind, Root, root},
    location::Remote,
};
