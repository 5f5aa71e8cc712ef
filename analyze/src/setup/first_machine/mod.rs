//! `inspect --write-machine`: a first machine file, guessed from a log and a URDF, with the reason of
//! each guess. Missing parts are commented out, with a note on what is needed. `machine new --log`: the same for the signals
//! of a machine from its data sheet.

mod arm;
mod can;
mod draft;
mod guesses;
mod imu;
mod joint_lines;
mod joints;
mod linkages;
mod of_sheet;
mod questions;
mod reference;
mod render;
mod signals;
mod text;
mod urdf;
mod wheels;
mod words;
mod write;
mod write_options;

pub use draft::Draft;
pub use of_sheet::{URDF, draft_of_sheet};
pub use questions::{Effect, OpenValue, OpenValues, ask, open_values};
pub use write::{draft, finished, write};
pub use write_options::WriteOptions;
