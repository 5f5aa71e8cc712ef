//! Exit codes, usage errors, and messages on standard error.

use std::process::ExitCode;

use crate::analysis::Analysis;
use crate::base::error_text::error_text;

/// Exit code: an error in a file, the machine description or the system.
const FAILED: u8 = 1;
/// Exit code: done, but bytes or messages of a log were lost.
const LOST: u8 = 3;
/// Exit code: a condition of `--fail-on` was met, or the policy was violated.
const CONDITION_MET: u8 = 4;
/// Exit code: a repeated analysis did not give the same bits.
const DIFFERS: u8 = 6;
/// Exit code: an analysis cannot be repeated as it was recorded.
const NOT_VERIFIABLE: u8 = 7;

/// How a command ended, from good to bad.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Exit {
    Done,
    Lost,
    ConditionMet,
    Differs,
    NotVerifiable,
    Failed,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        match exit {
            Exit::Done => Self::SUCCESS,
            Exit::Lost => Self::from(LOST),
            Exit::ConditionMet => Self::from(CONDITION_MET),
            Exit::Differs => Self::from(DIFFERS),
            Exit::NotVerifiable => Self::from(NOT_VERIFIABLE),
            Exit::Failed => Self::from(FAILED),
        }
    }
}

/// Contradictory arguments: exit code 2.
#[derive(Debug)]
pub(super) struct Usage(pub(super) &'static str);

impl std::fmt::Display for Usage {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(self.0)
    }
}

impl std::error::Error for Usage {}

/// Messages on standard error, as many as the user asked for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Terminal {
    pub(super) quiet: bool,
    pub(super) verbose: bool,
}

impl Terminal {
    pub(super) fn print(self, text: &str) {
        if !self.quiet {
            eprintln!("{text}");
        }
    }

    pub(super) fn error(self, error: &anyhow::Error) {
        eprintln!("error: {}", error_text(error));
    }
}

pub(super) fn exit_of(analysis: &Analysis, is_condition_met: bool) -> Exit {
    if is_condition_met {
        Exit::ConditionMet
    } else if !analysis.losses.is_empty() {
        Exit::Lost
    } else {
        Exit::Done
    }
}
