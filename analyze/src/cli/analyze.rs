//! `tipwatch analyze`.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use tipwatch_binding::MachineFile;
use tipwatch_language::{say, told};
use tipwatch_mechanics::machine::NoteKind;

use super::exit::{Ending, Exit, Terminal, Usage};
use super::machine_file::MachineFileArgs;
use super::options::{AnalysisArgs, CaseArgs, LanguageArgs, PolicyArgs};
use crate::analysis::Analysis;
use crate::analysis::run;
use crate::base::error_text::{error_text, without_path};
use crate::base::file_hash::{self, FileHash};
use crate::base::options::{ColumnGroup, MOST_DRAWS, MoreColumns, Options, seconds};
use crate::base::output_place::OutputPlace;
use crate::base::progress::Progress;
use crate::base::transfer_text;
use crate::events::{Event, EventKind};
use crate::output;
use crate::output::clips::{self, ClipOptions};
use crate::output::custody::{self, Files, Origin};
use crate::output::{OutputOptions, Sinks};
use crate::policy::facts::{LogFacts, event_facts};
use crate::policy::{Judgement, Policy};
use crate::report;

#[derive(Debug, Args)]
pub(super) struct AnalyzeArgs {
    /// Logs: .mcap, .bag, .db3 or rosbag2 folders; also in a bucket or on a web server (s3://, gs://, az://,
    /// https://).
    #[arg(required = true)]
    logs: Vec<PathBuf>,
    #[command(flatten)]
    machine: MachineFileArgs,
    /// Output folder; several logs are written to DIR/<name of the log>/.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    analysis: AnalysisArgs,
    /// Start time (seconds after the first sample).
    #[arg(long, value_name = "S", allow_negative_numbers = true, value_parser = seconds)]
    from: Option<f64>,
    /// End time (seconds after the first sample).
    #[arg(long, value_name = "S", value_parser = seconds)]
    to: Option<f64>,
    /// Draw N machines (at most 10000) with lengths, angles, masses and inertias varied by up to 10 %, and write the
    /// bands of their loads.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST_DRAWS)))]
    monte_carlo: Option<u32>,
    /// Optional columns of samples.parquet; may be repeated.
    #[arg(long, value_enum, value_delimiter = ',')]
    columns: Vec<ColumnGroup>,
    #[command(flatten)]
    files: OutputOptions,
    /// Also write the report as PDF/A: `report.pdf`.
    #[arg(long)]
    pdf: bool,
    #[command(flatten)]
    clips: ClipArgs,
    #[command(flatten)]
    policy: PolicyArgs,
    #[command(flatten)]
    case: CaseArgs,
    #[command(flatten)]
    language: LanguageArgs,
    /// The recorded analysis that is repeated.
    #[arg(skip)]
    repeated: Option<Repeated>,
}

/// Clips of the log.
#[derive(Debug, Args)]
struct ClipArgs {
    /// Also cut each group of events out of the log: `clips/NNNN_KIND.mcap`, with every topic as recorded.
    #[arg(long)]
    clips: bool,
    /// Time of a clip before the start of an event, in seconds.
    #[arg(long, value_name = "S", default_value = "30", value_parser = not_negative, requires = "clips")]
    clip_before: f64,
    /// Time of a clip after the end of an event, in seconds.
    #[arg(long, value_name = "S", default_value = "10", value_parser = not_negative, requires = "clips")]
    clip_after: f64,
    /// Kinds of events to cut out. Default: wheel_light, wheel_lift, edge_tipping and tip_over.
    #[arg(
        long,
        value_enum,
        value_name = "EVENT",
        value_delimiter = ',',
        requires = "clips"
    )]
    clip_events: Vec<EventKind>,
}

impl ClipArgs {
    fn options(&self) -> Option<ClipOptions> {
        self.clips.then(|| ClipOptions {
            before_s: self.clip_before,
            after_s: self.clip_after,
            kinds: self.clip_events.clone(),
        })
    }
}

fn not_negative(text: &str) -> Result<f64, String> {
    let value = seconds(text)?;
    match value >= 0.0 {
        true => Ok(value),
        false => Err("expected a number of seconds that is not negative".into()),
    }
}

/// Values that a repeated analysis takes from its record.
#[derive(Debug, Clone)]
struct Repeated {
    origin: Origin,
    program_sha256: Option<String>,
}

impl AnalyzeArgs {
    /// Repeats the analysis of one log in another folder, under its recorded origin.
    pub(super) fn repeat(
        &mut self,
        log: &Path,
        out: &Path,
        origin: Origin,
        program: Option<&FileHash>,
    ) {
        self.logs = vec![log.into()];
        self.out = out.into();
        self.repeated = Some(Repeated {
            origin,
            program_sha256: program.and_then(|file| file.sha256.clone()),
        });
    }

    /// Notes where an analysis comes from.
    fn note_origin(&self, analysis: &mut Analysis) {
        let Some(repeated) = &self.repeated else {
            return self.case.origin().note(analysis);
        };
        repeated.origin.note(analysis);
        if let (Some(program), Some(sha256)) =
            (&mut analysis.provenance.program, &repeated.program_sha256)
        {
            // another build must differ in nothing else
            program.sha256 = Some(sha256.clone());
        }
    }
}

pub(super) fn run(args: &AnalyzeArgs, terminal: Terminal) -> Result<Exit> {
    if let (Some(from), Some(to)) = (args.from, args.to)
        && from >= to
    {
        bail!(Usage("--from must be before --to"));
    }
    args.language.choose();
    file_hash::begin_program();
    let file = args.machine.read()?;
    let options = Options {
        from_s: args.from,
        to_s: args.to,
        monte_carlo: args.monte_carlo.map(|draws| draws as usize),
        columns: MoreColumns {
            parts: args.columns.contains(&ColumnGroup::Parts),
            terms: args.columns.contains(&ColumnGroup::Terms),
        },
        ..args.analysis.options()
    };
    let policy = args.policy.policy()?;
    let min_valid = args.policy.min_valid(policy.as_ref());
    let mut exit = Exit::DONE;
    for (log, out) in args.logs.iter().zip(out_folders(&args.logs, &args.out)?) {
        let one = analyze_one(
            log,
            &file,
            options,
            &out,
            args,
            policy.as_ref(),
            min_valid,
            terminal,
        );
        exit = exit.and(match one {
            Ok(one) => one,
            Err(error) => failed(&error, log, &out, policy.as_ref(), terminal)?,
        });
    }
    Ok(exit)
}

/// Ends the analysis of a log that could not be analysed: the policy fails, too, unless it accepts such logs.
fn failed(
    error: &anyhow::Error,
    log: &Path,
    out: &Path,
    policy: Option<&Policy>,
    terminal: Terminal,
) -> Result<Exit> {
    terminal.error(error);
    let Some(policy) = policy else {
        return Ok(Exit::FAILED);
    };
    let judgement = policy.judge_failed(&without_path(&error_text(error), log));
    if judgement.policy_sha256.is_some() {
        let target = OutputPlace::folder(out)?;
        output::write_judgement(&judgement, target.path())?;
        target.publish(output::JUDGEMENT)?;
    }
    print_violated(&judgement, terminal);
    Ok(match judgement.passed {
        true => Exit::DONE,
        false => Exit::FAILED,
    })
}

fn print_violated(judgement: &Judgement, terminal: Terminal) {
    for rule in judgement.violated() {
        terminal.print(&say!("rule violated: {}: {}", rule.rule, rule.found));
    }
}

#[expect(
    clippy::too_many_arguments,
    reason = "all of them are inputs of one log"
)]
fn analyze_one(
    log: &Path,
    file: &MachineFile,
    options: Options,
    out: &Path,
    args: &AnalyzeArgs,
    policy: Option<&Policy>,
    min_valid: f64,
    terminal: Terminal,
) -> Result<Exit> {
    let target = OutputPlace::folder(out)?;
    let place = out;
    let out = target.path();
    let mut progress = Progress::new(log, terminal.quiet);
    let (mut analysis, sinks) = run::analyse_into(
        log,
        file,
        options,
        &mut |bytes| progress.at(bytes),
        |prepared| Sinks::begin(prepared, out, args.files),
    )?;
    progress.finish();
    args.note_origin(&mut analysis);
    if let Some(options) = args.clips.options() {
        clips::cut(&mut analysis, log, out, &options)?;
    }
    let output::Written { files, sketch } = output::finish(&analysis, sinks, out)?;
    let clips = analysis.clips.iter().flatten();
    let mut written: Vec<&str> = clips.map(|clip| clip.file.path.as_str()).collect();
    written.extend(files);
    if args.pdf {
        output::write_pdf(&analysis, sketch.as_ref(), out)?;
        written.push(output::PDF);
    }
    analysis.rows.check()?;
    let judgement = policy.map(|policy| {
        let facts = LogFacts::of(
            &analysis,
            &report::findings(&analysis),
            report::doubts(&analysis),
        );
        policy.judge(&facts, &event_facts(&analysis), min_valid)
    });
    // only a policy file gets a result file; --fail-on is on the command line
    if let Some(judgement) = judgement.as_ref().filter(|j| j.policy_sha256.is_some()) {
        output::write_judgement(judgement, out)?;
        written.push(output::JUDGEMENT);
    }
    let files = Files {
        log,
        policy: args.policy.file(),
        written: &written,
        transfers: &analysis.transfers,
    };
    let findings = findings(&analysis, terminal);
    let ending = Ending::of(&analysis, min_valid);
    let (provenance, rows) = (&analysis.provenance, analysis.rows);
    // both take time after a long log: to hash the files, and to give back what the rows were computed from
    let (record, ()) = rayon::join(|| custody::write(provenance, files, out), || drop(rows));
    let record = record?;
    target.publish(custody::RECORD)?;
    findings.iter().for_each(|line| terminal.print(line));
    terminal.print(&say!("results: {}", place.display()));
    if terminal.verbose {
        transfer_text::lines(&analysis.transfers).for_each(|line| terminal.print(&line));
        terminal.print(&format!("custody.json: SHA-256 {record}"));
    }
    let exit = ending.tell(terminal);
    let Some(judgement) = judgement else {
        return Ok(exit);
    };
    print_violated(&judgement, terminal);
    Ok(Exit {
        broken: judgement.is_broken_by_evidence(),
        undecided: exit.undecided || judgement.undecided.is_some(),
        ..exit
    })
}

/// Returns the first findings as lines, or all of them if the user asked for more output.
fn findings(analysis: &Analysis, terminal: Terminal) -> Vec<String> {
    let shown = match terminal.verbose {
        true => usize::MAX,
        // what is lost comes first
        false => analysis.gross_inputs.len().max(3) + usize::from(!analysis.losses.is_empty()),
    };
    let found = report::findings(analysis);
    // that nothing lifted rests on signals that the log may not have tested
    let is_close_call = |event: &Event| {
        use EventKind::{EdgeTipping, TipOver, WheelLift, WheelLight};
        matches!(event.kind, WheelLight | WheelLift | EdgeTipping | TipOver)
    };
    let nothing_happened = !analysis.events.iter().any(is_close_call);
    let is_shown = |kind: NoteKind| match kind {
        NoteKind::InputFault | NoteKind::Unconfirmed => true,
        NoteKind::Untested => nothing_happened,
        NoteKind::Remark | NoteKind::ImuMountingConflict => false,
    };
    let faults = analysis.notes.iter().filter(|note| is_shown(note.kind));
    let shown = found.iter().take(shown);
    let mut lines: Vec<String> = shown.map(|finding| format!("- {finding}")).collect();
    // beside the gravest finding
    if let Some(doubted) = report::doubted(analysis) {
        lines.insert(lines.len().min(1), format!("- {doubted}"));
    }
    lines.extend(faults.map(|fault| format!("- {fault}")));
    lines.push(told(report::BANDS).into());
    lines.extend((analysis.clips.as_ref()).map(|clips| say!("clips: {}", clips.len())));
    lines
}

/// The output folder of each log.
fn out_folders(logs: &[PathBuf], out: &Path) -> Result<Vec<PathBuf>> {
    if let [_] = logs {
        return Ok(vec![out.into()]);
    }
    let mut folders: Vec<PathBuf> = Vec::new();
    for log in logs {
        let stem = log
            .file_stem()
            .with_context(|| format!("{}: expected a file name, found none", log.display()))?;
        let folder = out.join(stem);
        if folders.contains(&folder) {
            bail!(
                "{}: expected logs of different names, found \"{}\" twice",
                log.display(),
                stem.display()
            );
        }
        folders.push(folder);
    }
    Ok(folders)
}
