//! The screen's loop: reads verdicts like any other reader, and draws them.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use anyhow::{Result, bail};
use ratatui::crossterm::event::{self, Event, KeyCode, KeyModifiers};
use ratatui::{DefaultTerminal, Frame};

use super::screen::{View, draw};
use crate::node::{LiveNode, Receiver, Sender, ServiceAddress};
use crate::system::clock::monotonic_ns;
use crate::system::signals;
use crate::wire::identity::new_identity;
use crate::wire::names::Names;
use crate::wire::topics::{
    EVENT_ROW, Wire, WireAcknowledge, WireCommand, WireMachine, WireVerdict,
};

/// Time between two frames.
const FRAME_PERIOD: Duration = Duration::from_millis(50);
/// Period at which the nodes of dead processes are removed.
const DEAD_NODE_CHECK: Duration = Duration::from_secs(1);

/// Shows verdicts until `q` is pressed or a signal comes. `a` acknowledges the alarm.
///
/// # Errors
/// Stdout is not a terminal, or the shared memory fails.
pub fn watch(address: &ServiceAddress) -> Result<()> {
    if !std::io::stdout().is_terminal() {
        bail!("watch: expected a terminal; other programs use `monitor --json`");
    }
    let node = LiveNode::new(address, "tipwatch-watch")?;
    let mut watching = Watching {
        verdicts: node.receiver()?,
        machines: node.receiver()?,
        commands: node.receiver()?,
        acknowledge: node.sender(new_identity(0), 0)?,
        node,
        view: View::default(),
        checked: Instant::now(),
        rows: Rate::default(),
    };
    let mut terminal = ratatui::init();
    let result = watching.run(&mut terminal);
    ratatui::restore();
    result
}

struct Watching {
    verdicts: Receiver<WireVerdict>,
    machines: Receiver<WireMachine>,
    commands: Receiver<WireCommand>,
    acknowledge: Sender<WireAcknowledge>,
    node: LiveNode,
    view: View,
    checked: Instant,
    rows: Rate,
}

impl Watching {
    fn run(&mut self, terminal: &mut DefaultTerminal) -> Result<()> {
        while signals::check().is_ok() {
            self.receive()?;
            terminal.draw(|frame: &mut Frame<'_>| draw(frame, &self.view))?;
            if self.key()? {
                break;
            }
        }
        Ok(())
    }

    fn receive(&mut self) -> Result<()> {
        let (view, rows) = (&mut self.view, &mut self.rows);
        self.machines.receive(|wire| {
            if wire.is_whole()
                && let Ok(names) = Names::try_from(wire)
            {
                view.names = names;
                view.limits = wire.limits;
            }
        })?;
        self.verdicts.receive_all(|wire| {
            if wire.is_whole() {
                rows.count(u64::from(wire.event == EVENT_ROW));
                view.verdict = Some(*wire);
            }
        })?;
        self.commands.receive_all(|wire| {
            if wire.is_whole() {
                view.command = Some(*wire);
            }
        })?;
        view.rows_per_s = rows.per_second();
        view.now_ns = monotonic_ns();
        if self.checked.elapsed() >= DEAD_NODE_CHECK {
            self.checked = Instant::now();
            self.node.remove_dead_nodes();
        }
        Ok(())
    }

    /// Waits for a key; returns whether to quit.
    fn key(&mut self) -> Result<bool> {
        if !event::poll(FRAME_PERIOD)? {
            return Ok(false);
        }
        let Event::Key(key) = event::read()? else {
            return Ok(false);
        };
        let is_control_c =
            key.code == KeyCode::Char('c') && key.modifiers.contains(KeyModifiers::CONTROL);
        match key.code {
            KeyCode::Char('q') | KeyCode::Esc => return Ok(true),
            _ if is_control_c => return Ok(true),
            KeyCode::Char('a') => {
                // the one that is on the screen
                if let Some(verdict) = &self.view.verdict {
                    let mut message = WireAcknowledge::of(verdict);
                    self.acknowledge
                        .send_for(verdict.machine_hash, &mut message)?;
                }
                let command = self.view.command.as_ref();
                if let Some(command) = command.filter(|command| command.has_rod_fault()) {
                    let mut message = WireAcknowledge::of_command(command);
                    self.acknowledge
                        .send_for(command.machine_hash, &mut message)?;
                }
            }
            _ => {}
        }
        Ok(false)
    }
}

/// Rows per second, over the last second or so.
#[derive(Debug)]
struct Rate {
    since: Instant,
    count: u64,
    per_second: f64,
}

impl Default for Rate {
    fn default() -> Self {
        Self {
            since: Instant::now(),
            count: 0,
            per_second: f64::NAN,
        }
    }
}

impl Rate {
    fn count(&mut self, more: u64) {
        self.count += more;
    }

    fn per_second(&mut self) -> f64 {
        let elapsed = self.since.elapsed().as_secs_f64();
        if elapsed >= 1.0 {
            self.per_second = self.count as f64 / elapsed;
            self.since = Instant::now();
            self.count = 0;
        }
        self.per_second
    }
}
