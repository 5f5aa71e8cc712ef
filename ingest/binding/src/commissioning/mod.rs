//! The result of a commissioning, as a file and as text.

mod file;
mod text;

pub use file::{
    Commissioning, CommissioningError, CommissioningItem, CommissioningSource, NOT_COMMISSIONED,
    commissioning_of,
};
pub use text::commissioning_text;
