//! `inspect --write-machine`: a first machine file, guessed from a log and a URDF, with the reason of
//! each guess. Missing parts are commented out, with a note on what is needed.

mod arm;
mod can;
mod draft;
mod guesses;
mod imu;
mod joints;
mod linkages;
mod questions;
mod reference;
mod render;
mod section;
mod signals;
mod text;
mod urdf;
mod wheels;
mod words;
mod write;
mod write_options;

pub use draft::Draft;
pub use questions::{Effect, OpenValue, OpenValues, ask, open_values};
pub use section::signals;
pub use write::{draft, write};
pub use write_options::WriteOptions;
