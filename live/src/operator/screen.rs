//! Drawing of the screen.

use ratatui::Frame;
use ratatui::layout::{Alignment, Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Paragraph, Wrap};
use tipwatch_mechanics::number::SURE_SIGMAS;
use tipwatch_mechanics::state::Reason;
use tipwatch_mechanics::verdict::{Basis, InputFault, Level};

use crate::wire::command::{HoldReason, Mode};
use crate::wire::names::Names;
use crate::wire::prediction_text::prediction_text;
use crate::wire::topics::{WireCommand, WireVerdict};

/// Width of the text next to a bar (characters).
const WORDS: u16 = 42;

/// Lines of the level without what is not proven, of the utilisation and of the health.
const LEVEL: u16 = 5;
const MARGIN: u16 = 3;
const HEALTH: u16 = 8;

/// The state shown on the screen.
#[derive(Debug, Clone, Default)]
pub(super) struct View {
    /// Names of wheels and edges; empty before a session begins.
    pub(super) names: Names,
    /// Utilisation at which the levels notice, warning and danger begin.
    pub(super) limits: [f64; 3],
    /// The last verdict.
    pub(super) verdict: Option<WireVerdict>,
    /// The last valve command; `None` without a control.
    pub(super) command: Option<WireCommand>,
    /// Rows per second; NaN before the first second.
    pub(super) rows_per_s: f64,
    /// The current time (ns) of CLOCK_MONOTONIC.
    pub(super) now_ns: i64,
}

/// Draws the screen.
pub(super) fn draw(frame: &mut Frame<'_>, view: &View) {
    let Some(verdict) = &view.verdict else {
        let waiting = Paragraph::new("waiting for a monitor   (q: quit)").block(Block::bordered());
        frame.render_widget(waiting, frame.area());
        return;
    };
    let wheels = view.names.wheels.len() as u16;
    let inside = frame.area().width.saturating_sub(2).max(1);
    let room = frame.area().height.saturating_sub(LEVEL + MARGIN + HEALTH);
    let room_of_proof = room.saturating_sub(wheels);
    let proof = missing_proofs(view, verdict, |text| {
        lines_of(text, inside) <= room_of_proof
    });
    let proof_lines = proof.as_ref().map_or(0, |proof| lines_of(proof, inside));
    let proof_lines = proof_lines.min(room_of_proof);
    let apart = 2 * wheels + 1;
    let loads_lines = match proof_lines + apart <= room {
        true => apart,
        false => wheels,
    };
    let [level, margin, loads, health] = Layout::vertical([
        Constraint::Length(LEVEL + proof_lines),
        Constraint::Length(MARGIN),
        Constraint::Length(loads_lines),
        Constraint::Fill(1),
    ])
    .areas(frame.area());
    draw_level(frame, level, view, verdict, proof);
    draw_margin(frame, margin, view, verdict);
    draw_loads(frame, loads, view, verdict);
    draw_health(frame, health, view, verdict);
}

fn color(level: Level) -> Color {
    match level {
        Level::Unknown => Color::Gray,
        Level::Safe => Color::Green,
        Level::Assumed => Color::LightBlue,
        Level::Notice => Color::Cyan,
        Level::Warning => Color::Yellow,
        Level::Danger => Color::Red,
        Level::Fault => Color::Magenta,
    }
}

/// Returns the time since a verdict expired (s); `None` if it is valid.
fn expired_s(view: &View, verdict: &WireVerdict) -> Option<f64> {
    let over_ns = view.now_ns.saturating_sub(verdict.valid_until_ns);
    (over_ns > 0).then_some(over_ns as f64 * 1e-9)
}

/// The number of lines of a text that is wrapped at words.
fn lines_of(text: &str, width: u16) -> u16 {
    let (mut lines, mut used) = (1, 0);
    for word in text.split(' ') {
        let length = word.chars().count();
        if used > 0 && used + 1 + length > usize::from(width) {
            (lines, used) = (lines + 1, length);
        } else {
            used += length + usize::from(used > 0);
        }
    }
    lines
}

fn draw_level(
    frame: &mut Frame<'_>,
    area: Rect,
    view: &View,
    verdict: &WireVerdict,
    proof: Option<String>,
) {
    let shown = verdict.verdict();
    let expired = expired_s(view, verdict);
    let level = if expired.is_some() {
        Level::Fault
    } else {
        shown.level
    };
    let mut words = vec![Span::styled(
        format!(" {} ", level.name().to_uppercase()),
        Style::new()
            .fg(Color::Black)
            .bg(color(level))
            .add_modifier(Modifier::BOLD),
    )];
    if let Some(seconds) = expired {
        words.push(format!("  the monitor has been silent for {seconds:.1} s").into());
    } else if shown.latched_level > shown.level {
        let latched = Style::new().fg(color(shown.latched_level));
        let state = if verdict.latch().is_acknowledged {
            "acknowledged, not known to be over"
        } else {
            "not acknowledged (a)"
        };
        let text = format!("  {} {state}", shown.latched_level.name());
        words.push(Span::styled(text, latched));
    }
    let mut second = vec![];
    if verdict.time_to_lift_off_s.is_finite() {
        let wheel = view.names.wheels.get(verdict.next_wheel as usize);
        let wheel = wheel.map_or("?".into(), |name| name.to_uppercase());
        let text = match verdict.time_to_lift_off_s {
            0.0 => format!("{wheel} is off the ground"),
            seconds => format!("{wheel} lifts in {seconds:.1} s at the present rate"),
        };
        second.push(Span::styled(
            text,
            Style::new().add_modifier(Modifier::BOLD),
        ));
    }
    if verdict.doubted != 0 {
        let doubted = view.names.doubted(verdict).join(", ");
        let gap = if second.is_empty() { "" } else { "   " };
        second.push(Span::from(format!(
            "{gap}doubted since it failed: {doubted} (mend it, then acknowledge --signal NAME)"
        )));
    }
    if verdict.load_doubt != 0 {
        let gap = if second.is_empty() { "" } else { "   " };
        let text = view.names.load_doubt_text(verdict);
        second.push(Span::from(format!("{gap}{text}")));
    }
    let forces = view.names.force_doubt_text(verdict);
    if !forces.is_empty() {
        let gap = if second.is_empty() { "" } else { "   " };
        second.push(Span::from(format!("{gap}{forces}")));
    }
    let title = format!(" {} ", view.names.machine);
    let ahead = prediction_text(verdict, &view.names.wheels).filter(|_| expired.is_none());
    let mut text = vec![
        Line::from(words),
        Line::from(second),
        Line::from(ahead.unwrap_or_default()),
    ];
    text.extend(proof.map(Line::from));
    let level = Paragraph::new(text)
        .wrap(Wrap { trim: true })
        .alignment(Alignment::Center)
        .block(Block::bordered().title(title).border_style(color(level)));
    frame.render_widget(level, area);
}

/// Returns the missing proofs as text, with the ways to get them if the text `fits`; `None` if none is missing, or where the
/// basis is not assumed.
fn missing_proofs(
    view: &View,
    verdict: &WireVerdict,
    fits: impl Fn(&str) -> bool,
) -> Option<String> {
    let missing = view.names.missing_proofs_text(verdict);
    if verdict.verdict().basis != Basis::Assumed || missing.is_empty() {
        return None;
    }
    let whole = format!("not proven: {missing}");
    let names = || format!("not proven: {}", view.names.unproven(verdict).join(", "));
    Some(if fits(&whole) { whole } else { names() })
}

fn draw_margin(frame: &mut Frame<'_>, area: Rect, view: &View, verdict: &WireVerdict) {
    let [notice, warning, limit] = view.limits;
    let used = verdict.utilisation;
    let color = match used {
        used if !used.is_finite() => Color::DarkGray,
        used if used >= limit => Color::Red,
        used if used >= warning => Color::Yellow,
        used if used >= notice => Color::Cyan,
        _ => Color::Green,
    };
    let label = if used.is_finite() {
        format!(
            "{:4.0} % of the worst wheel's load is used up",
            100.0 * used
        )
    } else {
        "   ? %".into()
    };
    let block = Block::bordered().title(" utilisation ");
    let [text, beside] = beside(block.inner(area));
    frame.render_widget(block, area);
    frame.render_widget(Paragraph::new(label), text);
    draw_bar(frame, beside, share(used), color);
}

/// Splits a line into its text and the bar next to it.
fn beside(area: Rect) -> [Rect; 2] {
    Layout::horizontal([Constraint::Length(WORDS), Constraint::Min(10)]).areas(area)
}

/// Draws a bar over this share of a line, in steps of an eighth of a character.
fn draw_bar(frame: &mut Frame<'_>, line: Rect, share: f64, color: Color) {
    const PARTS: [&str; 8] = ["", "▏", "▎", "▍", "▌", "▋", "▊", "▉"];
    let eighths = (share * 8.0 * f64::from(line.width)).round() as usize;
    let bar = "█".repeat(eighths / 8) + PARTS[eighths % 8];
    frame.render_widget(Paragraph::new(bar).style(Style::new().fg(color)), line);
}

fn draw_loads(frame: &mut Frame<'_>, area: Rect, view: &View, verdict: &WireVerdict) {
    let wheels = view.names.wheels.len() as u16;
    let lines = if area.height < 2 * wheels { 1 } else { 2 };
    let rows =
        Layout::vertical(view.names.wheels.iter().map(|_| Constraint::Length(lines))).split(area);
    let standing = view
        .names
        .standing(verdict)
        .map_or(0, |wheels| wheels.len());
    let mean = verdict.normal_force / standing as f64;
    for (wheel, (name, &row)) in view.names.wheels.iter().zip(rows.iter()).enumerate() {
        let [label, bar] = beside(row);
        if !verdict.is_standing(wheel) {
            let state = match verdict.standing {
                0 => "?",
                _ => "off the ground",
            };
            let text = format!("{:>4} {state}", name.to_uppercase());
            frame.render_widget(Paragraph::new(text), label);
            continue;
        }
        let (load, sigma) = (verdict.load[wheel], verdict.load_sigma[wheel]);
        let text = format!(
            "{:>4} {} ± {} kN  otf {} kN",
            name.to_uppercase(),
            kilonewtons(load),
            kilonewtons(SURE_SIGMAS * sigma),
            kilonewtons(verdict.otf[wheel])
        );
        frame.render_widget(Paragraph::new(text), label);
        // a full bar is twice the mean load
        let share = share(load / (2.0 * mean));
        let is_surely_down = verdict.otf[wheel] - SURE_SIGMAS * verdict.otf_sigma[wheel] > 0.0;
        let color = if is_surely_down {
            Color::Blue
        } else {
            Color::Red
        };
        draw_bar(frame, Rect { height: 1, ..bar }, share, color);
    }
}

fn kilonewtons(newtons: f64) -> String {
    if newtons.is_finite() {
        format!("{:6.2}", newtons * 1e-3)
    } else {
        "     ?".into()
    }
}

fn share(value: f64) -> f64 {
    if value.is_finite() {
        value.clamp(0.0, 1.0)
    } else {
        0.0
    }
}

fn draw_health(frame: &mut Frame<'_>, area: Rect, view: &View, verdict: &WireVerdict) {
    let held = verdict.verdict().held;
    let join = |names: Vec<&str>| {
        if names.is_empty() {
            "none".to_owned()
        } else {
            names.join(", ")
        }
    };
    let faults = join(held.faults.iter().map(InputFault::name).collect());
    let cautions = join(held.cautions.iter().map(InputFault::name).collect());
    let mut reasons = verdict.row_reasons();
    reasons.add_all(held.reasons);
    let reasons = join(reasons.iter().map(Reason::name).collect());
    let age_ms = view.now_ns.saturating_sub(verdict.published_ns) as f64 * 1e-6;
    let delay_us = verdict
        .published_ns
        .saturating_sub(verdict.sample_published_ns) as f64
        * 1e-3;
    let timing = if verdict.untimed != 0 {
        "REPLAY at full speed: real time is not checked".to_owned()
    } else if verdict.sample_published_ns == 0 {
        "no sample yet".to_owned()
    } else {
        format!("sample to verdict {delay_us:.0} µs")
    };
    let per_s = match view.rows_per_s.is_finite() {
        true => format!(" ({:.0} per second)", view.rows_per_s),
        false => String::new(),
    };
    let zmp = if verdict.zmp_margin.is_finite() {
        format!("{:.3} m inside the edge", verdict.zmp_margin)
    } else {
        "unknown".into()
    };
    let ground = match view.names.ground_gap_text(verdict) {
        Some(gap) => format!("   supports: {gap}"),
        None => String::new(),
    };
    let lines = vec![
        Line::from(format!(
            "centre of pressure  {zmp}{ground}   {}",
            view.names.payload_text(verdict)
        )),
        Line::from(format!(
            "input faults {faults}   cautions {cautions}   row {reasons}"
        )),
        Line::from(format!(
            "samples  lost {}  refused {}  repeated {}   rows {}{per_s}",
            verdict.lost, verdict.refused, verdict.repeated, verdict.rows
        )),
        Line::from(format!("last verdict {age_ms:.0} ms ago   {timing}")),
        Line::from(suspension(view)),
        Line::from("q: quit   a: acknowledge"),
    ];
    let health = Paragraph::new(lines).block(Block::bordered().title(" health "));
    frame.render_widget(health, area);
}

/// The state of the suspension's control.
fn suspension(view: &View) -> String {
    let Some(command) = &view.command else {
        return "suspension  no control".into();
    };
    let over_ns = view.now_ns.saturating_sub(command.valid_until_ns);
    if over_ns > 0 {
        let seconds = over_ns as f64 * 1e-9;
        return format!("suspension  the control has been silent for {seconds:.1} s");
    }
    let actuators = (command.actuator_count as usize).min(command.opening.len());
    let percent = |opening: &f64| format!("{:+.0} %", 100.0 * opening);
    let openings: Vec<String> = command.opening[..actuators].iter().map(percent).collect();
    let why = if command.mode() == Mode::Follow {
        command.status_name().to_owned()
    } else {
        let reasons: Vec<&str> = command.reasons().iter().map(HoldReason::name).collect();
        reasons.join(", ")
    };
    let (mode, openings) = (command.mode().name(), openings.join("  "));
    format!("suspension  {mode} ({why})   valves {openings}")
}

#[cfg(test)]
mod tests {
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;
    use tipwatch_mechanics::machine::{Proof, Proofs};
    use tipwatch_mechanics::verdict::InputFaults;

    use super::*;

    fn view() -> View {
        let mut verdict = WireVerdict::unknown();
        verdict.level = Level::Warning as u32;
        verdict.latched_level = Level::Danger as u32;
        verdict.utilisation = 0.93;
        verdict.time_to_lift_off_s = 1.26;
        verdict.next_wheel = 1;
        verdict.normal_force = 40_000.0;
        verdict.load[..2].copy_from_slice(&[20_100.0, 1_234.0]);
        verdict.load_sigma[..2].copy_from_slice(&[100.0, f64::NAN]);
        verdict.otf = verdict.load;
        verdict.standing = 0b11;
        verdict.valid_until_ns = 100;
        verdict.faults = InputFaults::from(InputFault::Lost).bits();
        View {
            names: Names {
                machine: "forwarder-7".into(),
                wheels: vec!["fl".into(), "rr".into()],
                edges: vec![],
                joints: Vec::new(),
                load_sensors: Vec::new(),
                arm_forces: Vec::new(),
                commissioned: Vec::new(),
            },
            limits: [0.75, 0.9, 1.0],
            verdict: Some(verdict),
            command: None,
            rows_per_s: 100.0,
            now_ns: 50,
        }
    }

    fn drawn(view: &View) -> String {
        drawn_on(view, [100, 24])
    }

    fn drawn_on(view: &View, [width, height]: [u16; 2]) -> String {
        let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
        terminal.draw(|frame| draw(frame, view)).unwrap();
        terminal.backend().to_string()
    }

    #[test]
    fn screen_shows_level_loads_and_health() {
        let text = drawn(&view());
        for expected in [
            "forwarder-7",
            "WARNING",
            "danger not acknowledged",
            "RR lifts in 1.3 s",
            "otf  20.10 kN",
            "93 %",
            "20.10 ±   0.20 kN",
            "1.23 ±      ? kN",
            "lost",
        ] {
            assert!(text.contains(expected), "{expected} in\n{text}");
        }
    }

    #[test]
    fn what_is_not_proven_is_shown_whole() {
        let mut view = view();
        let verdict = view.verdict.as_mut().unwrap();
        verdict.level = Level::Assumed as u32;
        verdict.basis = Basis::Assumed as u32;
        view.names.joints = vec!["slew".into(), "lift".into()];
        let proofs = [
            Proof::AngularVelocity,
            Proof::Ground,
            Proof::Payload,
            Proof::Joint(0),
            Proof::Joint(1),
        ];
        verdict.unproven = proofs.into_iter().collect::<Proofs>().bits();
        let text = drawn_on(&view, [100, 30]);
        let words: Vec<&str> = text.split_whitespace().filter(|it| it.len() > 3).collect();
        for proof in proofs {
            let told =
                proof.name(|joint| view.names.joint(joint)) + " " + &proof.way(|_| String::new());
            for word in told.split(' ').filter(|word| word.len() > 3) {
                let is_shown = words.iter().any(|shown| shown.contains(word));
                assert!(is_shown, "{word} in\n{text}");
            }
        }
        // an alarm tells on what it stands, too
        view.verdict.as_mut().unwrap().level = Level::Notice as u32;
        assert!(drawn(&view).contains("not proven"));
    }

    #[test]
    fn a_small_terminal_shows_every_name_and_wheel_and_the_health() {
        let mut view = view();
        let verdict = view.verdict.as_mut().unwrap();
        verdict.level = Level::Assumed as u32;
        verdict.basis = Basis::Assumed as u32;
        verdict.standing = 0b1111;
        verdict.unproven = Proofs::ALL.bits();
        verdict.held_cautions = InputFaults::from(InputFault::Lost).bits();
        let named = |names: [&str; 4]| names.map(String::from).to_vec();
        view.names.wheels = named(["fl", "fr", "rl", "rr"]);
        view.names.joints = named(["slew", "lift", "fold", "reach"]);
        view.names.joints.push("tilt".into());
        let text = drawn_on(&view, [80, 24]);
        let shown: Vec<&str> = text.split_whitespace().collect();
        for name in view.names.unproven(view.verdict.as_ref().unwrap()) {
            let is_shown = shown.iter().any(|shown| shown.contains(&name));
            assert!(is_shown, "{name} in\n{text}");
        }
        for wheel in ["FL ", "FR ", "RL ", "RR ", "cautions lost", "q: quit"] {
            assert!(text.contains(wheel), "{wheel} in\n{text}");
        }
    }

    #[test]
    fn times_that_are_none_are_not_shown() {
        let mut view = view();
        view.rows_per_s = f64::NAN;
        let verdict = view.verdict.as_mut().unwrap();
        (verdict.published_ns, verdict.sample_published_ns) = (2_607_132_129_000, 0);
        let text = drawn(&view);
        assert!(
            !text.contains("NaN") && !text.contains("2607132129"),
            "{text}"
        );
        view.verdict.as_mut().unwrap().sample_published_ns = 2_607_132_099_000;
        assert!(drawn(&view).contains("sample to verdict 30 µs"));
    }

    #[test]
    fn bar_length_is_proportional() {
        let text = drawn(&view());
        let bar = |of: &str| {
            let line = text.lines().find(|line| line.contains(of));
            line.unwrap().matches('█').count()
        };
        // of 100 characters 42 are text, and a frame takes two
        assert_eq!(bar("93 %"), (0.93 * 56.0) as usize);
        assert_eq!(bar("20.10 ±"), (58.0 * 20_100.0 / 40_000.0) as usize);
    }

    #[test]
    fn screen_shows_the_suspension() {
        let mut view = view();
        assert!(drawn(&view).contains("no control"));
        let mut command = WireCommand::closed();
        command.actuator_count = 2;
        command.valid_until_ns = 100;
        view.command = Some(command);
        assert!(drawn(&view).contains("hold (no_row)"));
        command.mode = Mode::Follow as u32;
        command.status = 1;
        command.opening = [0.25, -0.5];
        view.command = Some(command);
        assert!(drawn(&view).contains("follow (optimal)   valves +25 %  -50 %"));
        view.now_ns = 1_000_000_100;
        assert!(drawn(&view).contains("control has been silent for 1.0 s"));
    }

    #[test]
    fn expired_verdict_is_shown_as_fault() {
        let mut view = view();
        view.now_ns = 2_000_000_100;
        let text = drawn(&view);
        assert!(
            text.contains("FAULT") && text.contains("silent for 2.0 s"),
            "{text}"
        );
        assert!(drawn(&View::default()).contains("waiting"));
    }
}
