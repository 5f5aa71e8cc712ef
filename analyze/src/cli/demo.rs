//! `tipwatch demo`.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use super::{Verdict, Voice, verdict};
use crate::demo;
use crate::output::{self, Outputs};

#[derive(Debug, Args)]
pub(super) struct DemoArgs {
    /// Where the results go.
    #[arg(long, default_value = "tipwatch-demo")]
    out: PathBuf,
}

pub(super) fn run(args: &DemoArgs, voice: Voice) -> Result<Verdict> {
    let out = &args.out;
    let analysis = demo::analyse(&out.join("input"))?;
    output::write(&analysis, out, Outputs::All)?;
    demo::tell(&analysis, out);
    voice.say("the log and the machine file of the demo are in its folder input/");
    Ok(verdict(&analysis, false))
}
