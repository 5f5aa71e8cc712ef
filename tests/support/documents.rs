//! The Rust snippets of the documents, compiled and run as doctests.

#![allow(missing_docs, dead_code, reason = "what is documented is elsewhere")]

#[doc = include_str!("../../book/src/architecture.md")]
struct Architecture;
