//! Standard deviations compared with actual errors: 24 logs of machines drawn from the stated uncertainty.

use tipwatch_analyze::analysis::Analysis;
use tipwatch_analyze::analysis::run::analyse;
use tipwatch_analyze::base::options::Options;
use tipwatch_analyze::tables::parquet;
use tipwatch_analyze::tables::table::Table;
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::{Quantity, Scope, State, Workspace, combination_sigma, evaluate};
use tipwatch_tests::data;

const LOGS: i64 = 24;
const WHEELS: [&str; 4] = ["fl", "fr", "rl", "rr"];
/// Span at each end (ns) that is not compared: the estimator lacks neighbouring samples there.
const MARGIN_NS: i64 = 150_000_000;

/// Tally of errors against the ground truth: how many lie within two standard deviations.
#[derive(Default)]
struct Tally {
    inside: f64,
    all: f64,
    squares: f64,
    sigmas: Vec<f64>,
}

impl Tally {
    fn count(&mut self, error: f64, sigma: f64) {
        self.inside += f64::from(u8::from(error.abs() < 2.0 * sigma));
        self.all += 1.0;
        self.squares += error * error;
        self.sigmas.push(sigma);
    }

    fn share(&self) -> f64 {
        self.inside / self.all
    }

    fn root_mean_square(&self) -> f64 {
        (self.squares / self.all).sqrt()
    }

    fn median_sigma(&mut self) -> f64 {
        self.sigmas.sort_by(f64::total_cmp);
        self.sigmas[self.sigmas.len() / 2]
    }
}

#[test]
fn val_two_sigma_bands_contain_the_true_loads() {
    let truth = parquet::read(&data("coverage.truth.parquet")).unwrap();
    let machine = MachineFile::read(&data("coverage.toml")).unwrap();
    let (mut loads, mut sums) = (Tally::default(), Tally::default());
    for log in 0..LOGS {
        let path = data(&format!("coverage_{log:02}.mcap"));
        let analysis = analyse(&path, &machine, Options::default(), &mut |_| {}).unwrap();
        let truth = TrueLoads::of(&truth, log);
        tally_loads(&analysis, &truth, &mut loads);
        tally_sums(&analysis, &truth, &mut sums);
    }
    let (load_share, sum_share) = (loads.share(), sums.share());
    let (load_sigma, sum_sigma) = (loads.median_sigma(), sums.median_sigma());
    println!(
        "inside: loads {load_share:.3} (median sigma {load_sigma:.0} N, errors {:.0} N), axle and side sums {sum_share:.3} ({sum_sigma:.0} N, {:.0} N)",
        loads.root_mean_square(),
        sums.root_mean_square(),
    );
    // a normal distribution has 95.4 %
    assert!((0.94..=0.96).contains(&load_share), "{load_share}");
    // axle and side sums do not depend on the split between the diagonals, so their band is narrow
    assert!((0.985..=0.997).contains(&sum_share), "{sum_share}");
    assert!(
        load_sigma < 2350.0 && sum_sigma < 300.0,
        "{load_sigma} {sum_sigma}"
    );
}

fn tally_loads(analysis: &Analysis, truth: &TrueLoads, tally: &mut Tally) {
    let rows = &analysis.rows;
    for wheel in 0..WHEELS.len() {
        let load = rows.whole().outcomes.column(Quantity::Load(wheel));
        let sigma = rows.whole().outcomes.column(Quantity::LoadSigma(wheel));
        for row in (0..rows.len()).filter(|&row| rows.is_valid(row)) {
            if let Some(truth) = truth.at(rows.times_ns[row]) {
                tally.count(load[row] - truth[wheel], sigma[row]);
            }
        }
    }
}

/// Front, rear, left and right sums in every tenth row in which all wheels touch the ground.
fn tally_sums(analysis: &Analysis, truth: &TrueLoads, tally: &mut Tally) {
    let (machine, rows) = (&analysis.machine, &analysis.rows);
    let mut workspace = Workspace::with_scope(machine, Scope::ALL);
    let mut state = State::zero(machine);
    for row in (0..rows.len())
        .step_by(10)
        .filter(|&row| rows.is_valid(row))
    {
        let Some(truth) = truth.at(rows.times_ns[row]) else {
            continue;
        };
        rows.whole().states.get(row, &mut state);
        let otf = evaluate(machine, &state, &mut workspace).otf.clone();
        if truth.iter().any(|&load| load < 100.0) {
            continue;
        }
        for factors in [
            [1.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, 1.0],
            [1.0, 0.0, 1.0, 0.0],
            [0.0, 1.0, 0.0, 1.0],
        ] {
            let error: f64 = (0..4).map(|w| factors[w] * (otf[w] - truth[w])).sum();
            tally.count(
                error,
                combination_sigma(machine, &state, &workspace, &factors),
            );
        }
    }
}

/// Ground truth of one log.
struct TrueLoads {
    times_ns: Vec<i64>,
    loads: Vec<Vec<f64>>,
}

impl TrueLoads {
    fn of(all: &Table, log: i64) -> Self {
        let logs = all.column("log").unwrap().integers().unwrap();
        let this: Vec<bool> = logs.into_iter().map(|l| l == log).collect();
        let times = all.column("t_ns").unwrap().integers().unwrap();
        let kept = |values: Vec<f64>| {
            let pairs = values.into_iter().zip(&this);
            pairs.filter(|(_, this)| **this).map(|(v, _)| v).collect()
        };
        let column = |wheel: &&str| {
            let column = all.column(&format!("load_{wheel}")).unwrap();
            kept(column.numbers().unwrap())
        };
        let times = times.into_iter().zip(&this);
        Self {
            times_ns: times.filter(|(_, this)| **this).map(|(t, _)| t).collect(),
            loads: WHEELS.iter().map(column).collect(),
        }
    }

    /// Linearly interpolated loads; `None` near and beyond the ends.
    fn at(&self, time_ns: i64) -> Option<[f64; 4]> {
        let (first, last) = (self.times_ns.first()?, self.times_ns.last()?);
        if time_ns < first + MARGIN_NS || time_ns > last - MARGIN_NS {
            return None;
        }
        let next = self.times_ns.partition_point(|&t| t < time_ns).max(1);
        let (a, b) = (self.times_ns[next - 1], self.times_ns[next]);
        let share = (time_ns - a) as f64 / (b - a) as f64;
        Some(std::array::from_fn(|wheel| {
            let loads = &self.loads[wheel];
            loads[next - 1] + share * (loads[next] - loads[next - 1])
        }))
    }
}
