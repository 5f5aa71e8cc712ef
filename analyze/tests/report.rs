//! The report: its first lines, its tables, its pictures, on a page and on paper.

use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::read::GzDecoder;
use tempfile::TempDir;
use tipwatch_analyze::analysis::Analysis;
use tipwatch_analyze::events::{Bound, Doubt, Event, EventKind, InputFault};
use tipwatch_analyze::report::{doubted, render, render_pdf, story};
use tipwatch_mechanics::machine::{FaultKind, Policy, SupportKind};
use tipwatch_mechanics::state::{Reason, Reasons};

use crate::support::{analysed, copy_log, data, stderr, text, tipwatch};

fn analysis(name: &str) -> Analysis {
    analysed(
        &data(&format!("{name}.mcap")),
        &data(&format!("{name}.toml")),
    )
}

fn page(analysis: &Analysis) -> String {
    render(analysis)
}

/// Returns the words that a reader sees on a page: no scripts, styles and tags.
fn words(page: &str) -> String {
    let mut text = String::new();
    let mut rest = page;
    while let Some(start) = rest.find('<') {
        text.push_str(&rest[..start]);
        text.push(' ');
        let skip = ["script", "style"]
            .into_iter()
            .find(|name| rest[start + 1..].starts_with(name));
        let end = match skip {
            Some(name) => rest[start..]
                .find(&format!("</{name}>"))
                .map(|end| end + name.len() + 2),
            None => rest[start..].find('>'),
        };
        rest = &rest[start + end.unwrap() + 1..];
    }
    text.push_str(rest);
    let text = text.replace("&quot;", "\"");
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn section<'a>(page: &'a str, title: &str) -> &'a str {
    let (_, behind) = page.split_once(&format!("<h2>{title}</h2>")).unwrap();
    behind.split("<h2>").next().unwrap()
}

/// Each slider passes through the logged value, between simulated values.
#[test]
fn the_sliders_begin_at_the_log() {
    let analysis = analysis("swing_lift");
    let found = tipwatch_analyze::report::sliders(&analysis).unwrap();
    let mut events = analysis.events.iter();
    let lift = events.find(|it| it.kind == found.kind && it.subject == found.subject);
    let answer = &lift.unwrap().counterfactuals[0].reply;
    assert_eq!(Some(found.logged.otf_n), answer.recorded_otf_n);
    for change in &found.changes {
        let at = change.simulated.iter().map(|it| it.at);
        assert!(at.is_sorted_by(|a, b| a < b), "{change:?}");
        let logged = change.simulated.iter().find(|it| it.at == change.logged);
        assert_eq!(logged.unwrap().otf_n, found.logged.otf_n);
        assert!(change.simulated.len() >= 3, "{change:?}");
    }
    let mut names = found.changes.iter().map(|change| change.name.as_str());
    assert!(names.any(|name| name.starts_with("Joint ")));
}

/// The machine as stated contradicts no lift where nothing lifted.
#[test]
fn a_log_without_a_lift_has_sliders() {
    let analysis = analysis("tiny");
    assert!(
        analysis
            .events
            .iter()
            .all(|event| !event.kind.is_observed())
    );
    let found = tipwatch_analyze::report::sliders(&analysis).unwrap();
    assert!(found.logged.otf_n > 0.0 && found.logged.probability.unwrap() < 0.02);
    let simulated = found.changes.iter().flat_map(|change| &change.simulated);
    assert!(simulated.into_iter().all(|it| it.probability.is_some()));
}

/// The first page leaves open what would have become of a fall that the stated machine does not show. Sliders answered it, by
/// the loads of a machine that never falls.
#[test]
fn a_fall_that_the_stated_machine_does_not_show_has_no_sliders() {
    let analysis = analysis("unstated_load");
    assert!(tipwatch_analyze::report::sliders(&analysis).is_err());
    assert!(!page(&analysis).contains("id=\"what-if-data\""));
}

#[test]
fn the_first_page_answers_what_an_expert_asks() {
    let analysis = analysis("swing_lift");
    let page = page(&analysis);
    let conclusion = words(section(&page, "Summary"));
    let questions = [
        "Did it tip over? No tip-over in",
        "Which wheels left the ground? If the front axle takes half",
        "When was it? Wheel RR off the ground at 20",
        "How sure is this? Confidence in \"wheel RR off the ground\": ",
        "On what does it hang most? ",
        "Under which assumptions? Masses and geometry as stated",
        "What is lost of the log? No damage",
        "Is the machine known? Commissioning: ",
        "Cause Load taken [N]",
        "swing_lift.mcap: SHA-256 1b0b5100",
    ];
    let places: Vec<usize> = questions
        .iter()
        .map(|q| {
            conclusion
                .find(q)
                .unwrap_or_else(|| panic!("{q}: {conclusion}"))
        })
        .collect();
    assert!(places.is_sorted(), "{places:?}");
    assert!(page.find("<h2>Summary").unwrap() < page.find("<h2>Events").unwrap());
    assert!(!words(&page).contains("front_share"));
    // date and time of an event, to the hundredth of a second
    let lift = analysis
        .events
        .iter()
        .find(|e| e.kind == EventKind::WheelLift)
        .unwrap();
    let time = jiff::Timestamp::from_nanosecond(i128::from(lift.start_ns + 5_000_000)).unwrap();
    let time = time.strftime("%Y-%m-%d %H:%M:%S%.2f UTC").to_string();
    assert!(
        conclusion.contains(&time) && section(&page, "Events").contains(&time),
        "{time}: {conclusion}"
    );
}

#[test]
fn a_tip_over_without_tilt_is_not_claimed_and_one_with_tilt_is() {
    let mut analysis = analysis("tiny");
    let rows = &analysis.rows.times_ns;
    let event = Event {
        worst: 900.0,
        worst_ns: rows[rows.len() - 1],
        unit: "N m",
        split_dependent: Some(false),
        ..Event::blank(EventKind::EdgeTipping, rows[rows.len() / 2], "left".into())
    };
    let answer = |analysis: &Analysis| words(section(&page(analysis), "Summary"));
    analysis.events = vec![event.clone()];
    assert!(
        answer(&analysis)
            .contains("Did it tip over? Not known: it was tipping about the left edge")
    );
    analysis.events = vec![Event {
        kind: EventKind::TipOver,
        worst: 0.5,
        ..event
    }];
    assert!(answer(&analysis).contains("Did it tip over? Yes, about the left edge"));
    // and nothing is concluded from nothing
    analysis.events.clear();
    let mut unknown = Reasons::NONE;
    unknown.add(Reason::ImuGap);
    analysis.rows.reasons.fill(unknown);
    assert!(
        answer(&analysis).contains("Did it tip over? Unknown"),
        "{}",
        answer(&analysis)
    );
}

#[test]
fn no_lift_is_claimed_only_under_the_splits_that_exclude_one() {
    let answer = words(section(&page(&analysis("forwarder6_bump")), "Summary"));
    assert!(
        answer.contains("a lift of") && answer.contains("cannot be excluded"),
        "{answer}"
    );
}

/// Flat ground and tyres are stated, so that the split is; the bands of the loads are wider than what they carry all the same. In the
/// simulation wheel FL carried nothing for a moment.
#[test]
fn no_lift_is_excluded_that_the_band_of_a_load_allows() {
    let with = |log: &str, machine: &str| {
        let analysis = analysed(&data(log), &data(machine));
        assert!(
            analysis
                .events
                .iter()
                .all(|event| event.kind != EventKind::WheelLift)
        );
        let wheels = analysis.digest.wheels.iter();
        let least_n = wheels.map(|wheel| wheel.least_in_band.unwrap().least_n());
        let least_n: Vec<f64> = least_n.collect();
        let answer = words(section(&page(&analysis), "Summary"));
        (least_n, answer)
    };
    let (least_n, answer) = with("coverage_14.mcap", "coverage.toml");
    assert!(least_n[0] < -500.0 && least_n[1] > 0.0, "{least_n:?}");
    assert!(!answer.contains("None in this log"), "{answer}");
    for wheel in ["wheel FL: ", "wheel RL: "] {
        assert!(answer.contains(wheel), "{wheel}: {answer}");
    }
    let (least_n, answer) = with("tiny.mcap", "tiny.toml");
    assert!(least_n.iter().all(|least_n| *least_n > 500.0));
    assert!(!answer.contains("Within the bands"), "{answer}");
}

/// The finding names each wheel whose band allows a lift, and the answer those beside a wheel that lifted.
#[test]
fn every_wheel_that_its_band_lets_lift_is_named() {
    let mut analysis = analysed(&data("coverage_14.mcap"), &data("coverage.toml"));
    let finding = words(section(&page(&analysis), "Summary"));
    let finding = finding.split("Did it tip over?").next().unwrap();
    for wheel in ["wheel FL: ", "wheel RL: "] {
        assert!(finding.contains(wheel), "{wheel}: {finding}");
    }
    let start_ns = analysis.rows.times_ns[100];
    analysis.events = vec![Event {
        end_ns: Some(start_ns + 100_000_000),
        ..Event::blank(EventKind::WheelLift, start_ns, "rl".into())
    }];
    let text = words(section(&page(&analysis), "Summary"));
    let (_, answer) = text.split_once("Which wheels left the ground?").unwrap();
    let answer = answer.split("When was it?").next().unwrap();
    assert!(answer.contains("RL (from"), "{answer}");
    assert!(answer.contains("wheel FL: "), "{answer}");
    assert!(!answer.contains("wheel RL: "), "{answer}");
}

/// Without bands, and where the machine tips, the least possible load of a wheel is unknown.
#[test]
fn without_a_band_in_every_row_no_lift_is_excluded() {
    let mut analysis = analysed(&data("coverage_14.mcap"), &data("coverage.toml"));
    let mut answer = |is_band_known: bool| {
        for wheel in &mut analysis.digest.wheels {
            wheel.least_in_band = None;
            wheel.is_band_known = is_band_known;
        }
        words(section(&page(&analysis), "Summary"))
    };
    let [known, unknown] = [true, false].map(&mut answer);
    assert!(known.contains("None in this log."), "{known}");
    assert!(unknown.contains("None as computed."), "{unknown}");
    // while it tips no band holds
    let knows = |name: &str| {
        let digest = self::analysis(name).digest;
        digest.wheels.iter().all(|wheel| wheel.is_band_known)
    };
    assert!(knows("tiny") && !knows("tip_over"));
}

/// The first sentences and the answer agree on whether the machine tipped over.
#[test]
fn without_gyro_and_attitude_a_tip_over_is_excluded_only_as_computed() {
    let mut analysis = analysis("tiny_lift");
    let told = |analysis: &Analysis| {
        let text = words(section(&page(analysis), "Summary"));
        let text = text.to_lowercase();
        let (story, answer) = text.split_once("did it tip over?").unwrap();
        [story, answer].map(|text| text.contains("as computed, no tip-over"))
    };
    assert_eq!(told(&analysis), [false; 2]);
    analysis.inputs.retain(|input| input.signal != "imu");
    analysis.digest.has_attitude = false;
    assert_eq!(told(&analysis), [true; 2]);
}

#[test]
fn the_first_page_names_the_signal_that_is_contradicted_beside_an_event() {
    let mut analysis = analysis("tip_over");
    assert_eq!(doubted(&analysis), None);
    let fault = InputFault {
        kind: FaultKind::Contradiction,
        policy: Policy::Invalid,
        limit: None,
        samples: 3,
        explanation: Some("the encoder of slew were off".into()),
        loads_are_right: Some(0.3),
        possible_since_ns: None,
    };
    let since_ns = analysis.rows.times_ns[100];
    let event = |fault| Event {
        unit: "rad",
        fault: Some(fault),
        ..Event::blank(EventKind::InputFault, since_ns, "joint_states.slew".into())
    };
    analysis.events.push(event(fault.clone()));
    let contradicted = doubted(&analysis).unwrap();
    assert!(contradicted.contains("the encoder of slew were off"));
    assert!(section(&page(&analysis), "Summary").contains(&contradicted));
    // a joint that is not measured any more
    analysis.events.pop();
    analysis.events.push(event(InputFault {
        kind: FaultKind::Frozen,
        explanation: None,
        loads_are_right: None,
        ..fault.clone()
    }));
    assert!(doubted(&analysis).is_some());
    // what is only reported leaves the loads as they are
    analysis.events.pop();
    analysis.events.push(event(InputFault {
        policy: Policy::Report,
        loads_are_right: None,
        ..fault
    }));
    assert_eq!(doubted(&analysis), None);
}

#[test]
fn two_hundred_input_faults_are_one_line_each_kind() {
    let mut analysis = analysis("tiny");
    let rows = analysis.rows.times_ns.clone();
    analysis.events = (0..200)
        .map(|index| Event {
            end_ns: Some(rows[index]),
            worst: index as f64,
            unit: "m/s^2",
            fault: Some(InputFault {
                kind: FaultKind::OutOfRange,
                policy: Policy::Report,
                limit: Some(1.0),
                samples: 3,
                explanation: None,
                loads_are_right: None,
                possible_since_ns: None,
            }),
            ..Event::blank(
                EventKind::InputFault,
                rows[index],
                ["imu.specific_force", "odometry.velocity"][index % 2].into(),
            )
        })
        .collect();
    let page = page(&analysis);
    let events = section(&page, "Events");
    assert_eq!(
        events
            .matches("<td class=\"whole\">100</td><td class=\"whole\">300</td>")
            .count(),
        2,
        "{events}"
    );
    assert!(words(events).contains("199 m/s^2"));
    assert_eq!(events.matches("<li><strong>").count(), 1);
}

#[test]
fn pictures_have_dimensions_and_the_envelope_is_drawn() {
    for (name, wheels) in [("forwarder6_bump", 6), ("tiny", 4)] {
        let page = page(&analysis(name));
        let summary = section(&page, "Summary");
        for part in ["wheelbase ", "track ", "centre of mass", "1 m"] {
            assert!(summary.contains(part), "{name}: {part}");
        }
        let loads = section(&page, "Wheel loads");
        assert!(loads.contains("Load, any split"), "{name}");
        assert_eq!(loads.matches("</tr>").count(), wheels + 1);
        assert!(page.contains("moment-space") && page.contains("moment-side"));
        let figures = figures(&page);
        let traces = figures
            .as_array()
            .unwrap()
            .iter()
            .flat_map(|figure| figure["traces"].as_array().unwrap());
        let envelopes: Vec<_> = traces.filter(|t| t["look"] == "envelope").collect();
        assert_eq!(envelopes.len(), wheels);
        assert!(envelopes.iter().all(|trace| trace["hidden"] == false));
    }
}

/// The figures of a page: gzip in base64.
fn figures(page: &str) -> serde_json::Value {
    let packed = page.split_once("id=\"figures\">").unwrap().1;
    let packed = packed.split("</script>").next().unwrap();
    let packed = STANDARD.decode(packed).unwrap();
    serde_json::from_reader(GzDecoder::new(packed.as_slice())).unwrap()
}

#[test]
fn the_path_is_drawn_where_odometry_gives_one() {
    let driven = page(&analysis("corner_brake"));
    let path = section(&driven, "Posture and path");
    let lines = path.split("<polyline class=\"used-").skip(1);
    let points = lines.map(|line| line.split_once('>').unwrap().0.matches(',').count());
    assert!(points.sum::<usize>() > 50);
    assert!(words(path).contains("integrated from the velocity"));
    assert!(!page(&analysis("tiny_lift")).contains("<h3>Path on the ground"));
}

#[test]
fn methods_validation_and_limitations_are_those_of_this_analysis() {
    let mut analysis = analysis("tiny_lift");
    let limits = |analysis: &Analysis| words(section(&page(analysis), "Limitations"));
    let with = limits(&analysis);
    analysis.inputs.retain(|input| input.signal != "odometry");
    analysis.rows.reasons[7].add(Reason::ImuGap);
    analysis.coverage.valid_share = Some(0.6);
    let without = limits(&analysis);
    assert!(!with.contains("loads are known in") && without.contains("loads are known in"));
    assert!(without.contains("No odometry was recorded"), "{without}");
    let page = page(&analysis);
    let validation = words(section(&page, "Validation"));
    assert!(validation.contains("drive, corner, brake 0.18 / 0.27 %"));
    assert!(!validation.contains("bogies"), "{validation}");
    let of_bogies = words(section(
        &self::page(&self::analysis("bogie_drive")),
        "Validation",
    ));
    assert!(of_bogies.contains("bogies"), "{of_bogies}");
    assert!(!of_bogies.contains("drive, corner, brake"), "{of_bogies}");
    assert!(words(section(&page, "Methods and assumptions")).contains("Newton-Euler"));
    for name in ["tiny", "bogie_drive", "forwarder6_bump"] {
        let text = words(&self::page(&self::analysis(name)));
        assert!(
            !text
                .split(|c: char| !c.is_alphanumeric())
                .any(|word| word == "NaN"),
            "{name}"
        );
    }
}

#[test]
fn the_report_on_paper_is_pdf_a_and_repeats_to_the_bit() {
    let analysis = analysis("forwarder6_bump");
    let bytes = render_pdf(&analysis).unwrap();
    assert!(bytes.starts_with(b"%PDF-1.7") && bytes.len() < 1_000_000);
    let text = String::from_utf8_lossy(&bytes);
    assert!(
        text.contains("pdfaid:part") && text.contains("OutputIntent") && text.contains("/FontFile")
    );
    assert!(bytes == render_pdf(&analysis).unwrap());
}

/// A court would read these loads as those of the wheels while the machine fell.
#[test]
fn a_fall_that_the_stated_machine_does_not_show_is_drawn_without_its_loads() {
    let drawing = |name: &str| {
        let page = page(&analysis(name));
        let summary = section(&page, "Summary");
        let (_, behind) = summary.split_once("<svg class=\"top-view\"").unwrap();
        behind.split("</svg>").next().unwrap().to_owned()
    };
    let marks = |drawing: &str| {
        [
            "class=\"load",
            "class=\"lifted\"",
            "class=\"zmp\"",
            "N</text>",
        ]
        .map(|mark| drawing.contains(mark))
    };
    assert_eq!(marks(&drawing("unstated_load")), [false; 4]);
    assert_eq!(marks(&drawing("tip_over")), [true; 4]);
}

/// A foot has no radius, and the cross over a support off the ground was a point. Beside it stood "0.0 kN", also of a wheel for
/// which the table has a load.
#[test]
fn a_foot_off_the_ground_has_a_cross_and_no_load() {
    let page = page(&analysis("crane"));
    let summary = section(&page, "Summary");
    let drawing = summary.split("<svg class=\"top-view\"").nth(1).unwrap();
    let drawing = drawing.split("</svg>").next().unwrap();
    let numbers = |line: &str| -> Vec<f64> {
        let at = ["x1=\"", "x2=\"", "y1=\"", "y2=\""].map(|name| line.split(name).nth(1).unwrap());
        at.map(|rest| rest.split('"').next().unwrap().parse().unwrap())
            .to_vec()
    };
    let crosses: Vec<Vec<f64>> = (drawing.split("class=\"lifted\"").skip(1))
        .map(numbers)
        .collect();
    assert_eq!(crosses.len(), 2, "{drawing}");
    for cross in crosses {
        assert!((cross[1] - cross[0]).abs() > 10.0, "{cross:?}");
        assert!((cross[3] - cross[2]).abs() > 10.0, "{cross:?}");
    }
    // what is computed of it within its error is no load that it carries
    assert!(!drawing.contains(">0.0 kN<"), "{drawing}");
}

#[test]
fn words_follow_the_kind_of_support() {
    let analysis = analysis("crane");
    let text = words(&page(&analysis)).to_lowercase();
    for wheel in analysis.machine.wheels() {
        let name = wheel.name.to_lowercase();
        let is_foot = wheel.kind == SupportKind::Foot;
        assert_eq!(
            text.contains(&format!("support {name}:")),
            is_foot,
            "{name}"
        );
        assert_eq!(text.contains(&format!("wheel {name}:")), !is_foot, "{name}");
        assert!(
            !is_foot || !text.contains(&format!("wheel {name}")),
            "{name}"
        );
    }
    assert!(!text.contains("tyre stiffness") && !text.contains("wheelbase"));
}

#[test]
fn a_report_is_small_and_loads_nothing() {
    let page = page(&analysis("swing_lift"));
    assert!(page.len() < 1_200_000, "{}", page.len());
    assert!(!page.contains("<script src") && !page.contains("<link"));
}

/// On level ground the demo lifts its wheel later: the two drawings are of one time all the same.
#[test]
fn a_supposition_is_drawn_at_the_time_of_the_record() {
    let demo = Path::new(env!("CARGO_MANIFEST_DIR")).join("demo");
    let (log, machine) = (demo.join("demo.mcap"), demo.join("demo.toml"));
    let out = TempDir::new().unwrap();
    let command = ["whatif", text(&log), "--slope-level"];
    let place = ["--machine", text(&machine), "--out", text(out.path())];
    let done = tipwatch(&[&command[..], &place].concat());
    let page = std::fs::read_to_string(out.path().join("comparison.html"));
    let page = page.unwrap_or_else(|error| panic!("{error}: {}", stderr(&done)));
    let heads = page.split("<h3>").skip(1);
    let heads = heads.filter_map(|rest| rest.split("</h3>").next());
    let times: Vec<&str> = heads
        .filter_map(|head| head.split("t = ").nth(1)?.split(' ').next())
        .collect();
    assert!(times.len() == 2 && times[0] == times[1], "{times:?}");
}

mod needs_browser {
    use std::collections::HashMap;

    use super::*;
    use crate::support::run_python;

    /// Tests a report in a browser in both languages; the analysis ends with this code.
    fn works_in_a_browser(log: &Path, machine: &Path, code: i32) {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/browser/report.py");
        let out = TempDir::new().unwrap();
        for language in ["en", "de"] {
            let out = out.path().join(language);
            let arguments = ["analyze", text(log), "--machine", text(machine)];
            let place = ["--lang", language, "--out", text(&out)];
            let analysed = tipwatch(&[&arguments[..], &place].concat());
            assert_eq!(analysed.status.code(), Some(code), "{}", stderr(&analysed));
            run_python(&[text(&script), text(&out.join("report.html"))]);
        }
    }

    #[test]
    #[ignore = "needs Chromium and Python with websocket-client and axe-playwright-python"]
    fn the_report_works_in_a_browser() {
        // lifts, a tip-over, feet beside raised wheels, a fall that the log ends in, nothing that happened, a short log
        for name in [
            "swing_lift",
            "forwarder6_bump",
            "tip_over",
            "crane",
            "forklift",
            "side_reach",
            "tiny",
        ] {
            let [log, machine] = ["mcap", "toml"].map(|kind| data(&format!("{name}.{kind}")));
            works_in_a_browser(&log, &machine, 0);
        }
    }

    #[test]
    #[ignore = "needs Chromium and Python with websocket-client and axe-playwright-python"]
    fn the_report_of_the_demo_works_in_a_browser() {
        let demo = Path::new(env!("CARGO_MANIFEST_DIR")).join("demo");
        works_in_a_browser(&demo.join("demo.mcap"), &demo.join("demo.toml"), 0);
    }

    #[test]
    #[ignore = "needs Chromium and Python with websocket-client and axe-playwright-python"]
    fn the_report_of_a_log_with_losses_works_in_a_browser() {
        let folder = TempDir::new().unwrap();
        let whole = std::fs::read(data("tip_over.mcap")).unwrap();
        let cut = folder.path().join("cut.mcap");
        std::fs::write(&cut, &whole[..whole.len() * 3 / 4]).unwrap();
        works_in_a_browser(&cut, &data("tip_over.toml"), 3);
    }

    /// One sample a second: its sentences are the longest.
    #[test]
    #[ignore = "needs Chromium and Python with websocket-client and axe-playwright-python"]
    fn the_report_of_a_sparse_log_works_in_a_browser() {
        let folder = TempDir::new().unwrap();
        let sparse = folder.path().join("sparse.mcap");
        let demo = Path::new(env!("CARGO_MANIFEST_DIR")).join("demo");
        let mut due_s: HashMap<String, f64> = HashMap::new();
        copy_log(&demo.join("demo.mcap"), &sparse, &[], &mut |message| {
            let due_s = due_s.entry(message.topic.to_owned()).or_default();
            let is_due = message.time_s >= *due_s;
            if is_due {
                *due_s = message.time_s + 0.95;
            }
            is_due
        });
        // between its rows a lift is not excluded
        works_in_a_browser(&sparse, &demo.join("demo.toml"), 8);
    }

    /// A machine that no simulation has made, where its log is beside the repository.
    #[test]
    #[ignore = "needs Chromium and Python with websocket-client and axe-playwright-python"]
    fn the_report_of_a_real_log_works_in_a_browser() {
        let log = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/logs/real/abitobot");
        if log.exists() {
            works_in_a_browser(&log, &data("abitobot.toml"), 0);
        }
    }

    /// From a disk, and after the folder was moved.
    #[test]
    #[ignore = "needs Chromium and Python with websocket-client and axe-playwright-python"]
    fn a_report_of_a_fleet_works_in_a_browser_with_the_scripts_beside_it() {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/browser/report.py");
        let folder = TempDir::new().unwrap();
        let (out, moved) = (folder.path().join("fleet"), folder.path().join("moved"));
        let (log, machine) = (data("tip_over.mcap"), data("tip_over.toml"));
        let arguments = ["screen", text(&log), "--machine", text(&machine)];
        let screened = tipwatch(&[&arguments[..], &["--out", text(&out)]].concat());
        assert_eq!(screened.status.code(), Some(0), "{}", stderr(&screened));
        std::fs::rename(&out, &moved).unwrap();
        let mut reports = std::fs::read_dir(moved.join("reports")).unwrap();
        let report = reports.find_map(|entry| {
            let page = entry.unwrap().path().join("report.html");
            page.exists().then_some(page)
        });
        run_python(&[text(&script), text(&report.unwrap())]);
    }

    #[test]
    #[ignore = "needs Chromium and Python with websocket-client"]
    fn the_page_of_a_fleet_works_in_a_browser() {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/browser/fleet.py");
        let folder = TempDir::new().unwrap();
        let logs =
            ["tip_over", "swing_lift", "hard_brake"].map(|name| data(&format!("{name}.mcap")));
        let machine = data("tip_over.toml");
        // their reasons are not in the order of the alphabet
        let photos = [("1", "m"), ("2", "a"), ("3", "z")].map(|(name, content)| {
            let photo = folder.path().join(format!("{name}.mcap"));
            std::fs::write(&photo, content.repeat(20)).unwrap();
            photo
        });
        let logs = logs.iter().chain(&photos).map(|log| text(log));
        let asked: Vec<&str> = ["screen"].into_iter().chain(logs).collect();
        for language in ["en", "de"] {
            let out = folder.path().join(language);
            let more = [
                "--machine",
                text(&machine),
                "--lang",
                language,
                "--out",
                text(&out),
            ];
            let done = tipwatch(&[&asked[..], &more].concat());
            assert!(out.join("fleet.html").exists(), "{}", stderr(&done));
            run_python(&[text(&script), text(&out.join("fleet.html"))]);
        }
    }

    /// Pages beside the report: of a fleet, of a comparison, of a supposition.
    #[test]
    #[ignore = "needs Chromium and Python with websocket-client and axe-playwright-python"]
    fn pages_keep_no_reader_out() {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/browser/accessible.py");
        let folder = TempDir::new().unwrap();
        let (log, other) = (data("tip_over.mcap"), data("swing_lift.mcap"));
        let machine = data("tip_over.toml");
        let commands: [(&[&str], &str); 3] = [
            (&["screen", text(&log), text(&other)], "fleet.html"),
            (&["compare", text(&log), text(&other)], "comparison.html"),
            (&["whatif", text(&log), "--slope-level"], "comparison.html"),
        ];
        let pages = commands.map(|(command, page)| {
            let out = folder.path().join(command[0]);
            let more = ["--machine", text(&machine), "--out", text(&out)];
            let done = tipwatch(&[command, &more].concat());
            assert!(out.join(page).exists(), "{}", stderr(&done));
            out.join(page)
        });
        let pages = pages.each_ref().map(|page| text(page));
        run_python(&[&[text(&script)][..], &pages].concat());
    }
}

/// The first sentences hold what the finding holds, no more: with its condition, in the order of time, no tilt rounded up.
#[test]
fn the_first_sentences_are_no_surer_than_the_findings() {
    let lift = words(&page(&analysis("lift")));
    let rule = "if the front axle takes half of the difference between the sides";
    assert!(
        lift.contains(&format!("s ({rule}; confidence 8")),
        "{}",
        &lift[..600]
    );
    assert!(lift.contains("Slope of the ground (estimated: 6.0° ± "));
    // gyro and attitude show the lift before the loads show the wheel light
    let unstated = words(&page(&analysis("unstated_load")));
    let told = "stood still. Wheel FR left the ground at t = 3.63 ± 0.08 s, the machine tipped about the left edge from t = 3.63";
    assert!(unstated.contains(told), "{}", &unstated[..600]);
    let tipped = words(&page(&analysis("tip_over")));
    assert!(
        tipped.contains("left edge, by at least 49°."),
        "{}",
        &tipped[..600]
    );
}

/// An axle with a pivot carries its load at the pivot: the machine tips out of a triangle, and no sentence says otherwise.
#[test]
fn a_machine_on_an_axle_with_a_pivot_stands_on_three_points() {
    let mut analysis = analysis("forklift");
    let page = page(&analysis);
    let drawing = section(&page, "Summary")
        .split("<svg class=\"top-view\"")
        .nth(1)
        .unwrap();
    let (_, area) = drawing
        .split_once("<polygon class=\"support\" points=\"")
        .unwrap();
    assert_eq!(area.split('"').next().unwrap().split(' ').count(), 3);
    assert!(drawing.contains("<line class=\"axle\""));
    // those who do not see it are told what it shows
    let (_, told) = drawing.split_once("aria-label=\"").unwrap();
    let told = told.split('"').next().unwrap();
    // where the events say that it tips, the drawing does not say that it stands
    let point = "zero moment point is at the edge of the supports";
    assert!(
        told.contains("FR carries 30847 N") && told.contains(point),
        "{told}"
    );
    assert!(told.contains("FL is off the ground"), "{told}");
    assert!(
        drawing
            .split("</svg>")
            .next()
            .unwrap()
            .contains("class=\"lifted\"")
    );
    let text = words(&page);
    // the answer names the wheel that the first sentences name
    let (_, answer) = text.split_once("Which wheels left the ground?").unwrap();
    let answer = answer.split("When was it?").next().unwrap();
    assert!(answer.contains("FL (from"), "{answer}");
    assert!(answer.contains("wheel RL left the ground, too"), "{answer}");
    analysis
        .events
        .retain(|event| event.kind != EventKind::WheelLift);
    let alone = words(&self::page(&analysis));
    assert!(
        alone.contains("Beyond the stop of its axle wheel"),
        "{alone}"
    );
    let answer = alone.split_once("Which wheels left the ground?").unwrap().1;
    let answer = answer.split("When was it?").next().unwrap();
    // what tips over the edge is off the ground without an event of its own, too
    assert!(answer.contains("FL (from"), "{answer}");
    // what has a lift of its own is not told twice
    let tells = |analysis: &Analysis| {
        story(analysis)
            .concat()
            .contains("wheel RL left the ground, too")
    };
    assert!(tells(&analysis));
    let mut events = analysis.events.iter();
    let over = events.find(|event| event.kind == EventKind::TipOver);
    let start_ns = over.unwrap().start_ns + 500_000_000;
    let lift = Event::blank(EventKind::WheelLift, start_ns, "rl".into());
    analysis.events.push(lift);
    assert!(!tells(&analysis));
    assert!(!text.contains("no wheel was below its limit"));
    // rows before the onset are valid, also those with a wheel below its limit
    assert!(
        text.contains("No single change within limits would have kept every wheel at its limit.")
    );
    assert!(text.contains("load split: by equilibrium alone;"));
    assert!(text.contains("In 174 of 575 rows the machine was or may have been tipping"));
}

/// At the last rows of a log that breaks off in a fall the loads have no derivatives: those before have.
#[test]
fn a_log_that_breaks_off_says_on_what_it_hangs_and_when_it_breaks_off() {
    let folder = TempDir::new().unwrap();
    let cut = folder.path().join("cut.mcap");
    let whole = std::fs::read(data("tip_over.mcap")).unwrap();
    std::fs::write(&cut, &whole[..whole.len() * 6 / 10]).unwrap();
    let text = words(&page(&analysed(&cut, &data("tip_over.toml"))));
    let hangs_on = "On what does it hang most? Share of the front axle";
    assert!(text.contains(hangs_on), "{}", &text[..2500]);
    assert!(text.contains("from log time 2026-05-28 20:26:44.726 UTC on"));
}

/// `side_reach` lifts one wheel once, from 3.97 to 6.34 s. Behind a hole nobody knows whether it is the same lift: it is neither
/// counted twice nor left out.
#[test]
fn a_lift_behind_a_hole_is_not_counted_again() {
    let folder = TempDir::new().unwrap();
    let log = folder.path().join("hole.mcap");
    copy_log(&data("side_reach.mcap"), &log, &[], &mut |message| {
        message.topic != "/joint_states" || !(4.2..5.6).contains(&message.time_s)
    });
    let analysis = analysed(&log, &data("side_reach.toml"));
    let lifts = analysis.events.iter();
    let lifts: Vec<_> = lifts
        .filter(|event| event.kind == EventKind::WheelLift)
        .collect();
    assert!(
        matches!(&lifts[..], [first, next] if first.end_bound == Bound::AtOrAfter && next.start_bound == Bound::AtOrBefore),
        "{lifts:?}"
    );
    let words = words(&page(&analysis));
    assert!(!words.contains("2 times, first from"), "{words}");
    let told = format!(
        "until {:.2}",
        analysis
            .rows
            .seconds(analysis.rows.at(lifts[1].end_ns.unwrap()))
    );
    assert!(
        words.contains("again or still") && words.contains(&told),
        "{told}: {words}"
    );
}

/// A report states the speed of a creeping machine, not that the machine drove: a reader would take 4 cm/s for a drive.
#[test]
fn a_machine_that_creeps_is_told_with_its_speed() {
    let text = words(&page(&analysis("side_reach")));
    assert!(
        text.contains("the machine moved steadily at 0.03"),
        "{}",
        &text[..600]
    );
    assert!(!text.contains("drove"));
    let stands = words(&page(&analysis("tip_over")));
    assert!(stands.contains("the machine stood still"));
}

/// Of a wheel without an encoder nothing is known where there is no odometry either.
#[test]
fn a_machine_stood_still_only_where_something_shows_it() {
    let told = |renamed: bool| {
        let folder = TempDir::new().unwrap();
        let beside = |ending: &str| folder.path().join(format!("crane.{ending}"));
        let urdf = std::fs::read_to_string(data("crane.urdf")).unwrap();
        let urdf = match renamed {
            true => urdf.replace("<joint name=\"wheel_", "<joint name=\"spin_"),
            false => urdf,
        };
        std::fs::write(beside("urdf"), urdf).unwrap();
        std::fs::copy(data("crane.toml"), beside("toml")).unwrap();
        let analysis = analysed(&data("crane.mcap"), &beside("toml"));
        words(section(&page(&analysis), "Summary")).contains("stood still")
    };
    assert!(told(false));
    assert!(!told(true));
}

/// Each joint of the arm that moves the worst event's load has a slider, with five simulated values but at its limits.
#[test]
fn every_joint_of_the_arm_that_moves_the_load_has_a_slider() {
    for (name, joints) in [
        ("crane", ["slew", "luff"].as_slice()),
        ("swing_lift", &["slew", "lift", "tilt", "extension"]),
    ] {
        let found = tipwatch_analyze::report::sliders(&analysis(name)).unwrap();
        for joint in joints {
            let named = format!("Joint {joint}");
            let mut sliders = found.changes.iter();
            let slider = sliders.find(|it| it.name == named);
            let slider = slider.unwrap_or_else(|| panic!("{name}: no {named} in {found:?}"));
            let values = slider.simulated.len() + slider.not_simulated.len();
            assert!((3..=5).contains(&values), "{slider:?}");
        }
    }
}

/// The answers state why a confidence is low, before the parameters that the result depends on. They named the stated
/// uncertainties, which that probability does not come from.
#[test]
fn a_doubted_event_says_that_signals_contradict_each_other() {
    let mut analysis = analysis("swing_lift");
    let answers = |analysis: &Analysis| {
        let summary = words(section(&page(analysis), "Summary"));
        let behind = |question: &str| summary.split(question).nth(1).unwrap().to_owned();
        ["How sure is this?", "On what does it hang most?"].map(|question| {
            let answer = behind(question);
            let end = answer.find('?').unwrap();
            answer[..end].contains("signals contradict each other")
        })
    };
    assert_eq!(answers(&analysis), [false, false]);
    for event in &mut analysis.events {
        event.certainty = Some(0.85);
        event.doubt = Some(Doubt {
            subjects: vec!["loads below zero off the rear edge".into()],
            loads_are_right: 0.85,
        });
    }
    assert_eq!(answers(&analysis), [true, true]);
}

/// The second drawing lies in the plane in which the machine turns: over a side it is seen from behind, over its front from
/// the right.
#[test]
fn the_second_drawing_lies_in_the_plane_of_the_fall() {
    let seen = |analysis: &Analysis| {
        let page = page(analysis);
        let mut drawings = section(&page, "Summary").split("<svg class=\"top-view\"");
        let second = drawings.nth(2).unwrap();
        let second = second.split("</svg>").next().unwrap();
        ["From behind", "From the right"].map(|from| second.contains(from))
    };
    let mut analysis = analysis("tip_over");
    assert_eq!(seen(&analysis), [true, false]);
    for event in &mut analysis.events {
        if event.subject == "left" {
            event.subject = "front".into();
        }
    }
    assert_eq!(seen(&analysis), [false, true]);
}

/// A parameter that the result depends on most is called a default where the machine file does not state its uncertainty, and
/// only there.
#[test]
fn defaults_are_named_as_defaults() {
    let told = |analysis: &Analysis| {
        let page = words(&page(analysis));
        let (_, behind) = page.split_once("On what does it hang most?").unwrap();
        behind.split("Under which").next().unwrap().to_owned()
    };
    let by_default = "(by default: the machine file does not say how well)";
    let log = data("tip_over.mcap");
    let analysis = analysis("tip_over");
    assert!(told(&analysis).contains(by_default), "{}", told(&analysis));
    let most = analysis.sensitivity.as_ref().unwrap().ranked()[0];
    let key = most.parameter.uncertainty_key(&analysis.machine).unwrap();
    let text = std::fs::read_to_string(data("tip_over.toml")).unwrap();
    let stated = format!("{text}\n[uncertainty]\n{key} = {}\n", most.sigma);
    let folder = TempDir::new().unwrap();
    let beside = |ending: &str| folder.path().join(format!("tip_over.{ending}"));
    std::fs::copy(data("tip_over.urdf"), beside("urdf")).unwrap();
    std::fs::write(beside("toml"), stated).unwrap();
    let stated = told(&analysed(&log, &beside("toml")));
    assert!(!stated.contains(by_default), "{stated}");
}

/// Half the speed is that of what moved.
#[test]
fn half_the_speed_is_that_of_the_arm_where_the_base_rests() {
    let mut analysis = analysis("tiny_lift");
    let mut told = |base_rests: bool| {
        let events = analysis.events.iter_mut();
        for answer in events.flat_map(|event| &mut event.counterfactuals) {
            answer.base_rests = base_rests;
        }
        let text = words(&page(&analysis));
        ["with the arm at half", "with machine and arm at half"].map(|what| text.contains(what))
    };
    assert_eq!(told(true), [true, false]);
    assert_eq!(told(false), [false, true]);
}

/// A change with a chance of one half keeps no wheel at its limit, and one change is not several.
#[test]
fn what_would_have_prevented_an_event_is_as_sure_as_its_chance() {
    let mut analysis = analysis("tiny_lift");
    let mut with = |chance: f64, count: usize| {
        let advice = analysis.advice.as_mut().unwrap();
        advice.changes.truncate(count);
        for change in &mut advice.changes {
            change.chance = Some(chance);
        }
        let text = words(&page(&analysis));
        [
            "would have kept every wheel at its limit",
            "each of these changes",
        ]
        .map(|claim| text.contains(claim))
    };
    assert_eq!(with(0.99, 2), [true, true]);
    assert_eq!(with(0.5, 2), [false, true]);
    assert_eq!(with(0.5, 1), [false, false]);
}

/// A title is that of the changes below it: of four the first page shows three.
#[test]
fn the_title_of_what_would_have_prevented_it_is_that_of_the_changes_shown() {
    let mut analysis = analysis("tiny_lift");
    let changes = &mut analysis.advice.as_mut().unwrap().changes;
    let mut change = changes[0].clone();
    change.chance = Some(0.99);
    *changes = vec![change; 4];
    changes[3].chance = Some(0.5);
    let is_sure = |analysis: &Analysis| {
        let text = words(section(&page(analysis), "Summary"));
        text.contains("Simulated: what would have kept every wheel at its limit")
    };
    assert!(is_sure(&analysis));
    analysis.advice.as_mut().unwrap().changes[2].chance = Some(0.5);
    assert!(!is_sure(&analysis));
}

/// The first page tells one incident; advice on another one stands in its own section.
#[test]
fn advice_about_another_incident_is_not_on_the_first_page() {
    let mut analysis = analysis("tiny_lift");
    let is_told = |analysis: &Analysis| section(&page(analysis), "Summary").contains("Simulated: ");
    assert!(is_told(&analysis));
    let advice = analysis.advice.as_mut().unwrap();
    (advice.event_start_ns, advice.event_end_ns) = (0, 1);
    assert!(!is_told(&analysis));
}

/// Statements about a log with rows that are not valid name the valid ones.
#[test]
fn where_rows_are_not_valid_the_valid_ones_are_named() {
    let mut analysis = analysis("tiny");
    let rows = analysis.rows.len();
    let named = |analysis: &Analysis| words(&page(analysis)).contains("valid rows of ");
    analysis.digest.valid_rows = rows;
    assert!(!named(&analysis));
    analysis.digest.valid_rows = rows - 7;
    let text = words(&page(&analysis));
    let expected = format!("Based on the {} valid rows of {rows}; ", rows - 7);
    assert!(text.contains(&expected), "{expected}");
}

#[test]
fn figures_of_a_fall_whose_beginning_is_not_shown_mark_no_onset() {
    let mut analysis = analysis("tip_over");
    let onsets = |analysis: &Analysis| page(analysis).matches("dashed upright: onset").count();
    assert!(onsets(&analysis) > 0);
    for event in &mut analysis.events {
        event.is_under_way = true;
    }
    assert_eq!(onsets(&analysis), 0);
}

#[test]
fn how_fast_a_load_fell_is_told_by_the_wheel_itself() {
    let mut analysis = analysis("swing_lift");
    let is_told = |analysis: &Analysis| page(analysis).contains(", and its lift by ");
    assert!(is_told(&analysis));
    for event in &mut analysis.events {
        event.lead_from = Some("fl".into());
    }
    assert!(!is_told(&analysis));
}

#[test]
fn a_rotation_that_may_be_a_tip_over_is_not_denied() {
    let mut analysis = analysis("tip_over");
    for event in &mut analysis.events {
        if matches!(event.kind, EventKind::EdgeTipping | EventKind::TipOver) {
            event.certainty = Some(0.499_95);
        }
    }
    let text = words(&page(&analysis));
    let open = "Not known whether the machine tipped over: the platform rotated by at least ";
    // in the story and in the answer
    assert_eq!(text.matches(open).count(), 2);
    assert!(!text.to_lowercase().contains("no tip-over"));
}

#[test]
fn the_story_tells_the_tipping_that_went_on_beside_an_earlier_one() {
    let mut analysis = analysis("tip_over");
    let over = |event: &&Event| event.kind == EventKind::TipOver;
    let over = analysis.events.iter().find(over).unwrap().clone();
    let start_ns = over.start_ns - 400_000_000;
    let mut earlier = Event::blank(EventKind::EdgeTipping, start_ns, over.subject.clone());
    earlier.end_ns = Some(over.start_ns - 300_000_000);
    analysis.events.insert(0, earlier);
    let told = story(&analysis).join(" ").to_lowercase();
    let tipped = format!("the machine tipped about the {} edge from", over.subject);
    assert_eq!(told.matches(&tipped).count(), 2, "{told}");
}

#[test]
fn a_machine_file_with_readings_of_scales_is_that_of_a_weighed_machine() {
    let demo = Path::new(env!("CARGO_MANIFEST_DIR")).join("demo/demo.mcap");
    let of_demo = analysed(&demo, &demo.with_extension("toml"));
    let weighed = "weighed (weighings in the machine file: 6)";
    assert!(page(&of_demo).contains(weighed));
    assert!(!page(&analysis("swing_lift")).contains("weighed (weighings"));
}

#[test]
fn the_first_page_names_the_gaps_of_signals() {
    let mut analysis = analysis("swing_lift");
    assert!(!page(&analysis).contains("Without data: "));
    let first_ns = analysis.rows.times_ns[0];
    let mut gap = Event::blank(EventKind::InputGap, first_ns + 1_000_000_000, "imu".into());
    gap.end_ns = Some(first_ns + 2_500_000_000);
    analysis.events.push(gap);
    let text = words(&page(&analysis));
    assert!(text.contains("Without data: IMU from t = 1.00 to 2.50 s."));
}

#[test]
fn a_fall_behind_missing_rows_has_no_causes_and_says_that_it_may_be_earlier() {
    let mut analysis = analysis("tip_over");
    for event in &mut analysis.events {
        if matches!(event.kind, EventKind::EdgeTipping | EventKind::TipOver) {
            event.start_bound = Bound::AtOrBefore;
        }
    }
    let text = words(&page(&analysis));
    assert!(text.contains("The log does not show the onset"));
    assert!(!text.contains("What took the load: "));
    let (_, heading) = text.split_once("; it began at ").unwrap();
    let heading: String = heading.chars().take(40).collect();
    assert!(heading.contains(" or earlier"), "{heading}");
}

/// The first page of a log without an event was half blank: neither a time line nor a figure.
#[test]
fn a_log_without_an_event_shows_when_it_came_closest() {
    let mut analysis = analysis("tiny");
    let times_ns = &analysis.rows.times_ns;
    let [from, to] = [4, 2].map(|part| times_ns[times_ns.len() / part]);
    analysis.events = vec![Event {
        end_ns: Some(to),
        ..Event::blank(EventKind::InputGap, from, "imu".into())
    }];
    let page = page(&analysis);
    let sheet = section(&page, "Summary");
    let (_, line) = sheet.split_once("<figure class=\"timeline\">").unwrap();
    let (line, figures) = line.split_once("</figure>").unwrap();
    let bars = |class: &str| line.matches(&format!("class=\"step-{class}\"")).count();
    assert_eq!(["light", "lift", "tip", "gap"].map(bars), [1, 0, 0, 1]);
    assert!(bars("known") > 0);
    // marked in the chart of the loads and in that of the attitude
    assert!(figures.matches("class=\"event\"").count() > 1);
    let (_, wheel) = analysis.digest.lightest.unwrap();
    let wheel = &analysis.machine.wheels()[wheel].name;
    assert!(words(line).contains(wheel), "{line}");
}

/// "Minimum load 5193 N on wheel RL" stood above "6000 N on RR", each the smallest in its own way.
#[test]
fn the_first_sentence_is_about_the_load_that_is_drawn() {
    let mut analysis = analysis("tiny");
    let (row, wheel) = analysis.digest.lightest.unwrap();
    let other = (wheel + 1) % analysis.machine.wheels().len();
    for (row, wheel) in [(row, wheel), (row / 2, other)] {
        analysis.digest.lightest = Some((row, wheel));
        let told = story(&analysis).join(" ");
        let wheel = &analysis.machine.wheels()[wheel].name;
        let at = format!("wheel {wheel} at t = {:.2} s", analysis.rows.seconds(row));
        assert!(told.contains(&at), "{at}: {told}");
    }
}

/// In the simulation the wheel was off the ground, and the rows of a machine that tips were left out.
#[test]
fn a_wheel_that_its_band_lets_lift_while_the_machine_tips_is_named() {
    let mut analysis = analysis("tiny");
    let row = analysis.rows.len() / 2;
    let found = &mut analysis.digest.wheels[0];
    let mut band = found.least_in_band.unwrap();
    (band.row, band.otf_n, band.sigma_n) = (row, 100.0, 500.0);
    found.least_while_tipping = vec![band];
    let told = |analysis: &Analysis| {
        words(section(&page(analysis), "Summary")).contains("Within the bands a lift")
    };
    assert!(told(&analysis));
    // of a machine that falls over, the loads tell nothing of the wheels that it falls over
    let at_ns = analysis.rows.times_ns[row];
    analysis.events = vec![Event {
        worst: 0.5,
        ..Event::blank(EventKind::TipOver, at_ns - 1, "left".into())
    }];
    assert!(!told(&analysis));
}
