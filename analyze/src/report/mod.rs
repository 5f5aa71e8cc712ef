//! Stub.
use crate::analysis::Analysis;
/// Findings.
pub fn findings(_: &Analysis) -> Vec<String> { Vec::new() }
/// Page.
pub fn render(_: &Analysis) -> String { String::new() }
