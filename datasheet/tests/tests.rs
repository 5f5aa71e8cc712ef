//! Machines from data sheets.

#![allow(clippy::unwrap_used, reason = "a test that cannot continue fails")]

mod examples; // every template's worked example weighs what its sheet says
