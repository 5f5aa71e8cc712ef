//! Description that a monitor sends of itself, once in its run: every file of the session holds it, those that begin later too.

use super::pending::{Encoded, Kind};

/// Runs of a monitor that are remembered.
const MOST: usize = 16;

/// The messages of the last runs of a monitor, in order.
#[derive(Debug, Default)]
pub(super) struct LatchedProgram(Vec<Encoded>);

impl LatchedProgram {
    /// Remembers this message if it is one.
    pub(super) fn keep(&mut self, message: &Encoded) {
        if message.kind == Kind::Program {
            if self.0.len() == MOST {
                self.0.remove(0);
            }
            self.0.push(message.clone());
        }
    }

    /// Returns the description that a file that begins with this message lacks: the last one before the message, at the message's
    /// time; `None` if there is none, or the message is one itself.
    pub(super) fn before(&self, first: &Encoded) -> Option<Encoded> {
        let known = (self.0.iter()).rfind(|program| program.log_time_ns <= first.log_time_ns)?;
        (first.kind != Kind::Program).then(|| Encoded {
            session_ns: first.session_ns,
            log_time_ns: first.log_time_ns,
            ..known.clone()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(kind: Kind, log_time_ns: i64, data: u8) -> Encoded {
        Encoded {
            kind,
            sequence: 0,
            session_ns: log_time_ns,
            log_time_ns,
            publish_time_ns: log_time_ns,
            data: vec![data],
        }
    }

    #[test]
    fn a_file_gets_the_program_that_ran_when_it_began() {
        let mut programs = LatchedProgram::default();
        let sample = |time_ns| message(Kind::Sample(0), time_ns, 0);
        for message in [
            message(Kind::Program, 10, 1),
            sample(15),
            message(Kind::Program, 20, 2),
        ] {
            programs.keep(&message);
        }
        let found = |time_ns| {
            programs
                .before(&sample(time_ns))
                .map(|it| (it.log_time_ns, it.data))
        };
        assert_eq!(found(9), None);
        assert_eq!(found(19), Some((19, vec![1])));
        assert_eq!(found(30), Some((30, vec![2])));
        assert_eq!(programs.before(&message(Kind::Program, 30, 3)), None);
    }

    #[test]
    fn the_memory_is_bounded() {
        let mut programs = LatchedProgram::default();
        (0..100).for_each(|run| programs.keep(&message(Kind::Program, run, run as u8)));
        assert_eq!(programs.0.len(), MOST);
        assert_eq!(programs.0[MOST - 1].data, [99]);
    }
}
