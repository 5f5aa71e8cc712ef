//! The library for C and C++, `libtipwatch_client.so`: the transport of `tipwatch_client.h` over the monitor's shared memory
//!
//! The header does everything else: it seals and checks messages, counts them, and knows what they mean. Services, layouts
//! and settings come from the contract by which the monitor opens them.

pub mod c;
mod client;
mod failure;
mod service;

pub use client::Client;
