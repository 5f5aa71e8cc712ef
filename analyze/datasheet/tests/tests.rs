//! Machines from data sheets.

#![allow(clippy::unwrap_used, reason = "a test that cannot continue fails")]

mod dialogue; // questions instead of a sheet
mod examples; // every template's worked example weighs what its sheet says
mod excavator; // figures of the excavators' data sheets
mod plane; // places of arms in one plane
mod properties; // random sheets
mod refusals; // contradictions, wrong units, absurd numbers
mod sheets; // figures of data sheets that the examples do not state
mod tracks; // supports along their length
mod urdf; // read by independent parsers
