//! Open and assumed values of a first machine file, as questions: those first that move the wheel loads of this log most.

mod answer;
mod apply;
mod ask;
mod list;
mod open_value;
mod rank;

pub use ask::ask;
pub use open_value::{Effect, OpenValue, OpenValues};
pub use rank::open_values;
