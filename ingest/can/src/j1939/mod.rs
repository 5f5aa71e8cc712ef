//! SAE J1939: identifiers, messages of several packets, and the parameter groups that
//! can be read without a DBC file.

mod groups;
mod identifier;
mod transport;

pub(crate) use self::transport::{Assembled, Transport};
pub use self::{
    groups::{public_group, public_groups},
    identifier::Identifier,
};
