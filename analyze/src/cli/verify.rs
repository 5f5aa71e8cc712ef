//! `tipwatch verify`.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;

use super::analyze::{self, AnalyzeArgs};
use super::exit::{Exit, Terminal, Unverified};
use crate::base::fetched::Fetched;
use crate::base::file_hash::program;
use crate::output::custody::{Custody, Origin, RECORD};
use crate::output::differences;

#[derive(Debug, Args)]
pub(super) struct VerifyArgs {
    /// Output folder of `analyze` or `demo`, with its custody.json.
    folder: PathBuf,
    /// Also accept another build of the same version; its results must still have the same bits.
    #[arg(long)]
    other_build: bool,
}

/// The arguments of a recorded analysis.
type Recorded = fn(&Custody) -> Result<AnalyzeArgs>;

pub(super) fn run(args: &VerifyArgs, terminal: Terminal, recorded: Recorded) -> Result<Exit> {
    let fetched = Fetched::folder(&args.folder, "**")?;
    let folder = std::path::absolute(fetched.path())
        .with_context(|| format!("{}: cannot be found", args.folder.display()))?;
    let record = Custody::read(&folder)?;
    let (base, mut refusals) = record.base();
    refusals.extend(other_program(&record, args.other_build));
    if !refusals.is_empty() {
        for refusal in &refusals {
            terminal.print(&format!("refused: {refusal}"));
        }
        terminal.print("not verified: the analysis cannot be repeated as it was recorded");
        return Ok(Exit {
            unverified: Some(Unverified::NotRepeatable),
            ..Exit::DONE
        });
    }
    let again = repeat(&record, &base, recorded)?;
    let altered = record.changed_outputs(&folder);
    let mut differs = !altered.is_empty();
    for change in &altered {
        terminal.print(&format!("altered since the analysis: {change}"));
    }
    let repeated = Custody::read(again.path())?;
    for output in &record.outputs {
        let name = &output.path;
        let found = repeated.outputs.iter().find(|found| found.path == *name);
        let difference = match found {
            Some(found) if found.sha256 == output.sha256 => None,
            // an altered output cannot be compared in detail
            Some(_) => {
                let details = differences::between(&folder.join(name), &again.path().join(name));
                Some(details.ok().flatten().unwrap_or_else(|| "differs".into()))
            }
            None => Some("was not written again".into()),
        };
        differs |= difference.is_some();
        terminal.print(&match difference {
            None => format!("{name}: reproduced bit for bit"),
            Some(difference) => format!("{name}: NOT reproduced: {difference}"),
        });
    }
    let is_new = |name: &str| !record.outputs.iter().any(|output| output.path == name);
    for output in repeated
        .outputs
        .iter()
        .filter(|output| is_new(&output.path))
    {
        differs = true;
        terminal.print(&format!("{}: was not written before", output.path));
    }
    terminal.print(match differs {
        true => "not verified: outputs differ",
        false => "verified: the same inputs, the same program, the same bits",
    });
    Ok(Exit {
        unverified: differs.then_some(Unverified::Differs),
        ..Exit::DONE
    })
}

/// Describes the difference between this program and the recorded one; `None` if they are the same.
fn other_program(record: &Custody, other_build: bool) -> Option<String> {
    let version = env!("CARGO_PKG_VERSION");
    if record.tipwatch_version != version {
        return Some(format!(
            "made by tipwatch {}, this is {version}",
            record.tipwatch_version
        ));
    }
    let sha256 = |file: Option<&_>| -> String {
        file.map_or(
            "unknown".into(),
            |file: &crate::base::file_hash::FileHash| file.hash_text().to_owned(),
        )
    };
    let (recorded, ours) = (sha256(record.program.as_ref()), sha256(program().as_ref()));
    (recorded != ours && !other_build).then(|| {
        format!(
            "made by another build of tipwatch {version}: program SHA-256 {recorded}, this is {ours}; \
             --other-build accepts it"
        )
    })
}

/// Repeats the recorded analysis in a new folder.
fn repeat(record: &Custody, base: &Path, recorded: Recorded) -> Result<tempfile::TempDir> {
    let out = tempfile::tempdir().context("no temporary folder can be created")?;
    if base != Path::new("") {
        std::env::set_current_dir(base)
            .with_context(|| format!("{}: cannot be entered", base.display()))?;
    }
    let mut args = recorded(record)
        .with_context(|| format!("{RECORD}: the recorded command line cannot be repeated"))?;
    let origin = Origin {
        command_line: record.command_line.clone(),
        case: record.case.clone(),
        examiner: record.examiner.clone(),
    };
    args.repeat(
        record.log.as_ref(),
        out.path(),
        origin,
        record.program.as_ref(),
    );
    let quiet = Terminal {
        quiet: true,
        verbose: false,
    };
    if analyze::run(&args, quiet)?.failed {
        bail!("the recorded analysis failed when it was repeated");
    }
    Ok(out)
}
