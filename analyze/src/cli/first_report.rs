//! The first report of a log: its analysis in a folder, and a few lines with the main event and the next steps.

use std::path::Path;

use anyhow::Result;
use tipwatch_binding::MachineFile;
use tipwatch_language::{say, told};

use super::exit::{Ending, Terminal};
use super::options::CaseArgs;
use crate::analysis::{Analysis, DEFAULT_MIN_VALID, run};
use crate::base::options::Options;
use crate::base::progress::Progress;
use crate::base::stdout::to_stdout;
use crate::output::custody::{self, Files};
use crate::output::{self, OutputOptions};
use crate::report;

/// Analyses a log with every option at its default, writes the results into `out`, and prints the story, the gravest finding,
/// where the report is and the command that comes `next`.
///
/// # Errors
/// The log cannot be analysed, or a file cannot be written.
pub(super) fn write(
    log: &Path,
    file: &MachineFile,
    out: &Path,
    next: &str,
    terminal: Terminal,
) -> Result<Ending> {
    let mut progress = Progress::new(log, terminal.quiet);
    let read = &mut |bytes| progress.at(bytes);
    let analysis = run::analyse(log, file, Options::default(), read);
    progress.finish();
    let mut analysis = analysis?;
    CaseArgs::default().origin().note(&mut analysis);
    let written = output::write(&analysis, out, OutputOptions::default())?;
    let files = Files {
        log,
        policy: None,
        written: &written,
        transfers: &[],
    };
    custody::write(&analysis.provenance, files, out)?;
    print_findings(&analysis, out, next)?;
    Ok(Ending::of(&analysis, DEFAULT_MIN_VALID))
}

fn print_findings(analysis: &Analysis, out: &Path, next: &str) -> Result<()> {
    let mut lines = report::story(analysis);
    lines.extend(report::doubted(analysis));
    let findings = report::findings(analysis).into_iter().take(1);
    lines.extend(findings.map(|finding| format!("- {finding}")));
    lines.push(told(report::BANDS).into());
    let report = out.join("report.html");
    let report = report.canonicalize().unwrap_or(report);
    lines.push(say!("report: {}", report.display()));
    lines.push(say!("next: {next}\n"));
    to_stdout(&lines.join("\n"))
}
