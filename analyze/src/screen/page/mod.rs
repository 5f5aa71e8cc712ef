//! `fleet.html`: the daily overview of a fleet. One file that loads nothing, for screens of any width and for paper, in
//! colours that remain distinct in black and white. A script sorts and filters the logs; all else needs none.

mod analysed_log;
mod distributions;
mod explorer;
mod fleet_page;
mod outliers;
mod ranking;
mod tables;

pub(super) use fleet_page::render;
