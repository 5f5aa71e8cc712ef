//! The Python peer: the results that a careful engineer gets with SciPy and Pinocchio from the same log.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, Stdio};

use crate::{Turns, analyse};

const LOG: &str = "flat_arm";
/// Reads names of logs from standard input and answers each with the seconds that its analysis took. Start-up and
/// imports are not counted.
const SCRIPT: &str = "
import sys, time
sys.path.insert(0, sys.argv[1])
import baseline, scenarios
machine = scenarios.ALL[sys.argv[2]]().machine
print('ready', flush=True)
for log in sys.stdin:
    start = time.perf_counter()
    baseline.analyze(log.strip(), machine)
    print(time.perf_counter() - start, flush=True)
";

/// Measures in turns with the peer, or reports why it cannot take part.
pub(crate) fn measure(shared: &Path, folder: &Path, rounds: usize) {
    let (lab, logs) = (shared.join("lab"), shared.join("logs/sim"));
    let python = std::env::var("TIPWATCH_PYTHON").unwrap_or_else(|_| "python3".into());
    let log = logs.join(format!("{LOG}.mcap"));
    if !log.exists() {
        println!("the Python peer is left out: there is no {}", log.display());
        return;
    }
    let child = Command::new(&python)
        .args(["-c", SCRIPT])
        .args([&lab, Path::new(LOG)])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn();
    let Ok(mut child) = child else {
        println!("the Python peer is left out: {python} does not start");
        return;
    };
    let mut answers = BufReader::new(child.stdout.take().expect("piped")).lines();
    let mut answer = move || answers.next().and_then(Result::ok);
    if answer().as_deref() != Some("ready") {
        println!("the Python peer is left out: {python} lacks what it needs");
        return;
    }
    let mut questions = child.stdin.take().expect("piped");
    let machine = log.with_extension("toml");
    let mut peer_s = f64::INFINITY;
    let mut own_s = [f64::INFINITY; 2];
    for _ in 0..rounds {
        writeln!(questions, "{}", log.display()).expect("the peer reads");
        let took: f64 = (answer().and_then(|text| text.parse().ok())).expect("the peer's seconds");
        peer_s = peer_s.min(took);
        // The peer is slow; a few runs of ours fit beside each of its own.
        let turns = Turns::run(
            3,
            [&|| analyse(&log, &machine, folder, "samples"), &|| {
                analyse(&log, &machine, folder, "all");
            }],
        );
        for (which, own_s) in own_s.iter_mut().enumerate() {
            *own_s = own_s.min(turns.best_s(which));
        }
    }
    drop(questions);
    child.wait().expect("the peer ends");
    println!(
        "{LOG}: Python peer {peer_s:.2} s, samples.parquet {:.3} s, all files {:.3} s",
        own_s[0], own_s[1]
    );
    println!("figure samples-vs-python {:.2}", peer_s / own_s[0]);
    println!("figure all-files-vs-python {:.2}", peer_s / own_s[1]);
}
