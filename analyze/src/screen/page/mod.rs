//! `fleet.html`: the daily overview of a fleet. One file without scripts, for screens of any width and for
//! paper, in colours that remain distinct in black and white.

mod distributions;
mod fleet_page;
mod outliers;
mod ranking;
mod seen;
mod tables;
mod trend;

pub(super) use fleet_page::render;
