//! CAN (Controller Area Network): frames as loggers write them, and the numbers in them.
//!
//! - A [`FrameSource`] yields [`Frame`]s. [`Container`] reads the files of loggers (candump text, Vector ASC and
//!   BLF, PEAK PCAN traces, ASAM MF4), gives what is intact and reports what was lost.
//! - A [`Message`] says where signals are in the data of a frame. It comes from a DBC file ([`Database`]) or is one of
//!   the parameter groups of SAE J1939 that need no such file ([`j1939::public_group`]).
//! - A [`Decoder`] turns frames into signals in SI units, reassembles the transport protocol of J1939, and counts
//!   what is not a number: see [`Tally`].
//!
//! No input makes this crate panic, and no input makes it hold more than a bounded amount of memory.
//!
//! ```
//! use tipwatch_can::{Container, Decoder, Frame, FrameSource, Selection, j1939};
//!
//! let log = "(10.000000) can0 0CF02A21#007D007D807DFF05\n";
//! let mut source = Container::open(std::io::Cursor::new(log))?;
//! let rates = j1939::public_group(61482).ok_or("no such group")?;
//! let mut decoder = Decoder::new(vec![Selection::of(rates)]);
//! let mut frame = Frame::default();
//! while source.next_frame(&mut frame)? {
//!     decoder.decode(&frame, &mut |_, values| {
//!         // the yaw rate: half a degree per second
//!         assert!((values[2] - 1.0_f64.to_radians()).abs() < 1e-9);
//!     });
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bits;
mod container;
mod database;
mod decoder;
mod frame;
pub mod j1939;
mod message;
mod tally;
mod unit;

pub use crate::{
    container::{CandumpStream, Container, ContainerFormat, Lost, OpenError, Written},
    database::{Database, DatabaseError},
    decoder::{Decoder, Selection},
    frame::{CanId, Frame, FrameKind, FrameSource, MOST_DATA_BYTES},
    message::{Addressing, Message, Multiplexed, Protocol, Signal, ValueKind},
    tally::Tally,
    unit::SiUnit,
};
