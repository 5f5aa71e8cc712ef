//! `inspect --write-machine`: a first machine file, guessed from a log and a URDF, with the reason of
//! each guess. Missing parts are commented out, with a note on what is needed.

mod arm;
mod can;
mod guesses;
mod imu;
mod joints;
mod linkages;
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

pub use section::signals;
pub use write::write;
pub use write_options::WriteOptions;
