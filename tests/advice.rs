//! Advice: every change that is advised holds in an independent evaluation, row by row.

use tipwatch_analyze::analysis::Analysis;
use tipwatch_tests::data;

#[test]
fn show() {
    for (log, from, to) in runs() {
        let began = std::time::Instant::now();
        let analysis = analysed(log, from, to);
        let elapsed = began.elapsed();
        println!("==== {log} {to} {elapsed:?}");
        let Some(advice) = &analysis.advice else {
            println!("none; events {}", analysis.events.len());
            continue;
        };
        println!("{} limit {} worst {} window {:?} rows {} left {} held {} {:?}", advice.wheel, advice.limit_n, advice.worst_otf_n,
            (advice.to_ns - advice.from_ns) as f64*1e-9, advice.rows, advice.rows_left_out, advice.rows_held, advice.not_simulated);
        for c in &advice.changes {
            println!("  {} | effort {:.2} first {:?} least {:.1} sigma {:?} zmp {:?} mom {:?} any {}", c.statement, c.effort, c.first_order, c.least_otf_n, c.otf_sigma_n, c.zmp_margin_m, c.overturning_moment_nm, c.holds_under_any_split);
            for (w,m) in &c.wheels { print!("   {w} {:.0}->{:.0} (bound {:.0}; any {:.0}->{:.0})", m.otf_n.before, m.otf_n.after, m.bound_n, m.any_split_n.before, m.any_split_n.after); }
            println!();
        }
        for r in &advice.rejected { println!("  - {}: {}", r.name, r.reason); }
    }
}

fn runs() -> Vec<(&'static str, &'static str, &'static str)> {
    vec![
        ("../../analyze/demo/demo.mcap", "", ""),
        ("tiny_lift.mcap", "", ""),
        ("swing_lift.mcap", "", ""),
        ("hard_brake.mcap", "min_load = 500.0", "min_load = 1500.0"),
        ("corner_brake.mcap", "min_load = 500.0", "min_load = 6000.0"),
        ("lift_payload.mcap", "min_load = 500.0", "min_load = 4000.0"),
        ("tiny.mcap", "min_load = 500.0", "min_load = 6000.0"),
        ("forwarder6.mcap", "min_load = 500.0", "min_load = 9000.0"),
        ("folded_arm.mcap", "", ""),
        ("second_paper.mcap", "", ""),
        ("bogie_drive.mcap", "", ""),
    ]
}

fn analysed(log: &str, from: &str, to: &str) -> Analysis {
    use tipwatch_analyze::analysis::run::analyse;
    use tipwatch_analyze::base::options::Options;
    use tipwatch_binding::MachineFile;
    let log = data(log);
    let machine = log.with_extension("toml");
    let text = std::fs::read_to_string(&machine).unwrap();
    assert!(text.contains(from));
    let file = MachineFile::from_text(&machine, &text.replace(from, to)).unwrap();
    analyse(&log, &file, Options::default(), &mut |_| {}).unwrap()
}
