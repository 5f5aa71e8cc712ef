//! Machines that stand out in a fleet: found, reported with their confidence, and never out of too little data.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};
use tempfile::TempDir;

use super::screen::{files, screen};
use super::support::{command, data, json, stderr, text, tipwatch};

const DAY_NS: i64 = 86_400_000_000_000;

/// A log with the figures of its record.
struct Log {
    machine: usize,
    day: i64,
    margin: f64,
    exposed: f64,
    duration_s: f64,
    /// Version of its analysis.
    version: char,
}

/// A fleet that exists as records only: those of a real log with other numbers.
struct Fleet {
    folder: TempDir,
    pattern: Value,
}

impl Fleet {
    fn new() -> Self {
        let folder = TempDir::new().unwrap();
        let (logs, real) = (folder.path().join("logs"), folder.path().join("real"));
        fs::create_dir(&logs).unwrap();
        fs::copy(data("tiny.mcap"), logs.join("calm.mcap")).unwrap();
        let machine = data("tiny_lift.toml");
        screen(&logs, &real, &["--machine", text(&machine)]);
        let records = files(&real.join("state"));
        let mut records = records
            .into_iter()
            .filter(|(name, _)| name.ends_with(".json"));
        let pattern = json(&records.next().unwrap().1);
        Self { folder, pattern }
    }

    /// The comparisons and the page of these logs.
    fn gather(&self, logs: &[Log]) -> (Vec<Value>, String) {
        let place = self.folder.path().join("fleet");
        let _ = fs::remove_dir_all(&place);
        fs::create_dir_all(place.join("state")).unwrap();
        for (number, log) in logs.iter().enumerate() {
            let mut record = self.pattern.clone();
            record["path"] = json!(format!("/logs/{number:05}.mcap"));
            record["log_id"] = json!(format!("{number:064x}"));
            record["machine"]["name"] = json!(format!("fw-{:02}", log.machine));
            record["analysis_version"] = json!(log.version.to_string().repeat(64));
            let facts = &mut record["result"]["facts"];
            let start = 20_000 * DAY_NS + log.day * DAY_NS;
            facts["start_ns"] = json!(start);
            facts["start_utc_ns"] = json!(start);
            facts["worst"]["margin"] = json!(log.margin);
            facts["worst"]["sigma"] = json!(0.01);
            facts["exposure"]["exposed_s"] = json!(log.exposed * log.duration_s);
            facts["coverage"]["covered_s"] = json!(log.duration_s);
            facts["coverage"]["computable_s"] = json!(log.duration_s);
            facts["coverage"]["valid_share"] = json!(1.0);
            let path = place.join(format!("state/{number:05}-x-y.json"));
            fs::write(path, record.to_string()).unwrap();
        }
        let gathered = command(&["screen", "--gather", "--out", text(&place)])
            .output()
            .unwrap();
        assert!(gathered.status.success(), "{}", stderr(&gathered));
        let sql = "SELECT * FROM comparisons";
        let asked = tipwatch(&["query", text(&place), sql, "--json"]);
        let Ok(Value::Array(found)) = serde_json::from_slice(&asked.stdout) else {
            panic!("expected a list: {}", stderr(&asked));
        };
        (found, page(&place))
    }
}

/// A simulated log, stamped from zero, had no day though its report states that of the recorder; and no page told of logs without
/// one.
#[test]
fn a_log_has_the_day_of_its_report_and_those_without_are_counted() {
    let fleet = Fleet::new();
    let place = fleet.folder.path().join("dated");
    fs::create_dir_all(place.join("state")).unwrap();
    for (number, recorded) in [json!(20_000 * DAY_NS), Value::Null].iter().enumerate() {
        let mut record = fleet.pattern.clone();
        record["path"] = json!(format!("/logs/{number:05}.mcap"));
        record["log_id"] = json!(format!("{number:064x}"));
        let facts = &mut record["result"]["facts"];
        facts["start_ns"] = json!(5_000_000_000_i64);
        facts["start_utc_ns"] = recorded.clone();
        let path = place.join(format!("state/{number:05}-x-y.json"));
        fs::write(path, record.to_string()).unwrap();
    }
    let gathered = command(&["screen", "--gather", "--out", text(&place)])
        .output()
        .unwrap();
    assert!(gathered.status.success(), "{}", stderr(&gathered));
    let sql = "SELECT path FROM logs WHERE day = '2024-10-04'";
    let asked = tipwatch(&["query", text(&place), sql, "--json"]);
    let found: Value = serde_json::from_slice(&asked.stdout).unwrap();
    assert_eq!(found, json!([{ "path": "/logs/00000.mcap" }]));
    assert!(page(&place).contains("2024-10-04 (1 log without a date)"));
}

fn page(place: &Path) -> String {
    fs::read_to_string(place.join("fleet.html")).unwrap()
}

fn outliers(found: &[Value]) -> Vec<&Value> {
    found.iter().filter(|c| c["verdict"] == "outlier").collect()
}

/// Numbers from a normal distribution (SplitMix64, sum of twelve).
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        let uniform = |state: &mut u64| {
            *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
            let mut z = *state;
            z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
            ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(|_| uniform(&mut self.0)).sum::<f64>() - 6.0
    }
}

/// `machines` machines with a log a day: margins about 0.6, each machine a little different.
fn usual_fleet(machines: usize, days: i64, noise: &mut Noise) -> Vec<Log> {
    let mut logs = Vec::new();
    for machine in 0..machines {
        let own = 0.02 * noise.next();
        for day in 0..days {
            logs.push(Log {
                machine,
                day,
                margin: 0.6 + own + 0.03 * noise.next(),
                exposed: (0.02 + 0.002 * noise.next()).max(0.0),
                duration_s: 600.0 + 30.0 * noise.next(),
                version: 'a',
            });
        }
    }
    logs
}

#[test]
fn a_machine_that_changed_and_one_unlike_its_type_are_found() {
    let fleet = Fleet::new();
    let mut logs = usual_fleet(24, 40, &mut Noise(1));
    for log in &mut logs {
        match log.machine {
            // its margins fell in the last week
            3 if log.day >= 30 => log.margin -= 0.2,
            // it has always been closer to tipping than the others
            7 => log.margin -= 0.35,
            _ => {}
        }
    }
    let (found, page) = fleet.gather(&logs);
    let told: Vec<_> = outliers(&found)
        .iter()
        .map(|c| {
            (
                c["machine"].as_str().unwrap().to_string(),
                c["compared_with"].as_str().unwrap().to_string(),
                c["quantity"].as_str().unwrap().to_string(),
                c["is_worse"].as_bool().unwrap(),
            )
        })
        .collect();
    let expected = |machine: &str, with: &str| {
        (
            machine.to_string(),
            with.to_string(),
            "worst_margin".to_string(),
            true,
        )
    };
    assert_eq!(
        told,
        [expected("fw-03", "history"), expected("fw-07", "type")],
        "{found:?}"
    );
    for outlier in outliers(&found) {
        let confidence = outlier["confidence"].as_f64().unwrap();
        assert!((0.95..1.0).contains(&confidence), "{outlier}");
        assert!(outlier["value"].as_f64() < outlier["usual"].as_f64());
    }
    assert!(page.contains("Machines that stand out") && page.contains("fw-07"));
    let section = page.split("Machines that stand out").nth(1).unwrap();
    let section = section.split("</section>").next().unwrap();
    assert!(
        section.contains("30 days before and 10 since 2024-"),
        "{section}"
    );
    assert!(!section.contains("100.0 %"), "{section}");
}

#[test]
fn too_few_logs_are_said_and_are_no_finding() {
    let fleet = Fleet::new();
    // gross differences, but few days and few machines
    let mut logs = usual_fleet(4, 8, &mut Noise(2));
    logs.iter_mut()
        .filter(|log| log.machine == 1)
        .for_each(|log| log.margin = -0.5);
    let (found, page) = fleet.gather(&logs);
    assert!(outliers(&found).is_empty() && !found.is_empty());
    let reasons: Vec<_> = found
        .iter()
        .map(|c| c["reason"].as_str().unwrap())
        .collect();
    assert!(
        reasons
            .iter()
            .any(|reason| reason.contains("too few days: 8 of at least")),
        "{reasons:?}"
    );
    assert!(
        reasons
            .iter()
            .any(|reason| reason.contains("3 of at least 8")),
        "{reasons:?}"
    );
    assert!(page.contains("No machine can be compared yet"));
    assert!(found.iter().all(|c| c["confidence"].is_null()));
}

#[test]
fn longer_logs_are_not_taken_for_smaller_margins() {
    let fleet = Fleet::new();
    let mut logs = usual_fleet(2, 40, &mut Noise(3));
    for log in logs
        .iter_mut()
        .filter(|log| log.machine == 0 && log.day >= 30)
    {
        log.margin -= 0.3;
        log.duration_s *= 8.0;
    }
    let (found, _) = fleet.gather(&logs);
    assert!(outliers(&found).is_empty(), "{found:?}");
    assert!(found.iter().any(|c| {
        c["reason"]
            .as_str()
            .is_some_and(|r| r.contains("longer logs"))
    }));
}

/// Fleets of this size in which one machine falls from 50 % to 5 % for five days, the others by chance.
fn one_fell(machines: usize, days: i64, fell_at: i64, seed: u64) -> Vec<Log> {
    let mut noise = Noise(seed);
    let mut logs = Vec::new();
    for machine in 0..machines {
        for day in 0..days {
            let has_fallen = machine == 2 && day >= fell_at;
            let level = if has_fallen { 0.05 } else { 0.5 };
            logs.push(Log {
                machine,
                day,
                margin: level + 0.02 * noise.next(),
                exposed: 0.02,
                duration_s: 600.0,
                version: 'a',
            });
        }
    }
    logs
}

#[test]
fn a_machine_that_fell_is_found_in_small_and_large_fleets() {
    let fleet = Fleet::new();
    for (machines, days, fell_at) in [
        (5, 18, 13),
        (20, 18, 13),
        (100, 18, 13),
        (20, 60, 13),
        (20, 60, 55),
    ] {
        let (found, _) = fleet.gather(&one_fell(machines, days, fell_at, 5));
        let all = outliers(&found);
        // a machine that is low on most of its days is unlike its type, too
        assert!(all.iter().all(|c| c["machine"] == "fw-02"), "{all:?}");
        let with_history = |c: &&&Value| c["compared_with"] == "history";
        let outliers: Vec<&&Value> = all.iter().filter(with_history).collect();
        assert_eq!(
            outliers.len(),
            1,
            "{machines} machines, {days} days: {all:?}"
        );
        assert_eq!(outliers[0]["count"], days - fell_at);
    }
}

/// One driver of three changed: the middle of the day's logs does not.
#[test]
fn a_shift_that_fell_is_found_among_those_that_did_not() {
    let fleet = Fleet::new();
    let mut logs = one_fell(20, 18, 13, 6);
    for seed in [7, 8] {
        let mut others = one_fell(20, 18, 18, seed);
        logs.append(&mut others);
    }
    let (found, _) = fleet.gather(&logs);
    let told = outliers(&found);
    assert_eq!(told.len(), 1, "{told:?}");
    assert_eq!(told[0]["machine"], "fw-02");
    assert_eq!(told[0]["compared_with"], "history");
    assert_eq!(told[0]["count"], 5);
    assert!((told[0]["value"].as_f64().unwrap() - 0.35).abs() < 0.02);
}

#[test]
fn fleets_without_outliers_stay_without_findings() {
    let fleet = Fleet::new();
    let alarms = (10..22).filter(|&seed| {
        let (found, _) = fleet.gather(&usual_fleet(12, 24, &mut Noise(seed)));
        assert!(
            found.iter().all(|c| c["verdict"] != "not_comparable"),
            "{found:?}"
        );
        !outliers(&found).is_empty()
    });
    assert_eq!(alarms.count(), 0);
}

/// Weather, site and work of a day are often those of the day before. An alarm in 5 % of the fleets for worse and for better days each
/// is what is allowed; without a look at the neighbours 6 of these 8 fleets have one.
#[test]
fn days_that_resemble_their_neighbours_are_no_change() {
    let fleet = Fleet::new();
    let alarms = (0..8).filter(|&seed| {
        let mut noise = Noise(seed);
        let mut logs = usual_fleet(12, 40, &mut noise);
        let mut state = 0.0;
        for log in &mut logs {
            state = if log.day == 0 {
                noise.next()
            } else {
                0.7 * state + 0.71 * noise.next()
            };
            log.margin = 0.5 + 0.06 * state;
        }
        !outliers(&fleet.gather(&logs).0).is_empty()
    });
    let alarms = alarms.count();
    assert!(alarms <= 2, "{alarms}");
}

/// Another machine file or program may make any difference; one that came later explains none.
#[test]
fn a_change_that_came_with_another_analysis_is_no_finding_and_is_told() {
    let fleet = Fleet::new();
    for (changed_on, verdict) in [(30, "not_comparable"), (20, "outlier")] {
        let mut logs = usual_fleet(5, 40, &mut Noise(4));
        for log in &mut logs {
            log.version = if log.day < changed_on { 'a' } else { 'b' };
            if log.machine == 2 && log.day >= 30 {
                log.margin -= 0.4;
            }
        }
        let (found, page) = fleet.gather(&logs);
        let is_it = |c: &&Value| {
            c["machine"] == "fw-02"
                && c["compared_with"] == "history"
                && c["quantity"] == "worst_margin"
        };
        let of_margin = found.iter().find(is_it).unwrap();
        assert_eq!(of_margin["verdict"], verdict, "{of_margin}");
        let usual = of_margin["usual"].as_f64().unwrap();
        assert!(of_margin["value"].as_f64().unwrap() < usual - 0.3);
        assert_eq!(outliers(&found).len(), usize::from(verdict == "outlier"));
        assert_eq!(
            page.contains("changed at the same time"),
            verdict != "outlier"
        );
    }
}

/// A machine that does in some of its logs what the others never do is unlike them, whatever its usual log is.
#[test]
fn time_that_no_other_machine_has_is_found() {
    let fleet = Fleet::new();
    let mut logs = usual_fleet(20, 10, &mut Noise(5));
    for log in &mut logs {
        log.exposed = if log.machine == 7 && log.day % 5 < 2 {
            0.5
        } else {
            0.0
        };
    }
    let (found, _) = fleet.gather(&logs);
    let told = outliers(&found);
    assert_eq!(told.len(), 1, "{told:?}");
    assert_eq!(told[0]["machine"], "fw-07");
    assert_eq!(told[0]["quantity"], "exposed_share");
    assert!((told[0]["value"].as_f64().unwrap() - 0.2).abs() < 0.02);
}
