//! The frame in which the log gives the tool's wrench.

use nalgebra::Isometry3;
use tipwatch_language::say;

use super::checker::Checker;
use crate::machine::{MachineError, Mount, MountSource, Note, NoteKind};

impl Checker<'_> {
    /// The pose of the frame in which the wrench of the tool is given: that of its messages, else that of the tool's link.
    /// `None` with a note if the messages are those of another place of the machine, and the machine file does not name them.
    pub(super) fn wrench(
        &self,
        tool_link: usize,
    ) -> Result<(Option<Mount>, Option<Note>), MachineError> {
        let of_link = self.mount(tool_link, Isometry3::identity(), MountSource::MachineFile);
        let frame = self
            .log
            .tool_wrench_frame
            .map(|f| f.trim_start_matches('/'));
        let Some(frame) = frame.filter(|frame| !frame.is_empty()) else {
            return Ok((Some(of_link), None));
        };
        let tool = &self.tree.links[tool_link].name;
        match self.places_of(frame).into_iter().next() {
            None => {
                let text = say!(
                    "The wrench of the tool is in frame {frame}, which neither the URDF nor a static transform places: its axes \
                     and origin are assumed to be those of {tool}."
                );
                Ok((Some(of_link), Some(Note::new(NoteKind::Unconfirmed, text))))
            }
            Some(mount) if mount.body == of_link.body => {
                let is_link = mount.body_from_mount == of_link.body_from_mount;
                Ok((Some(if is_link { of_link } else { mount }), None))
            }
            Some(_) if self.spec.signals.tool_wrench.is_some() => Err(MachineError::Value {
                file: self.spec.file.clone(),
                place: "signals.tool_wrench".into(),
                expected: format!("messages in a frame that moves with {tool} (arm.tool)"),
                found: format!("header.frame_id {frame}, which a joint moves against it"),
            }),
            Some(_) => {
                let text = say!(
                    "The wrench of frame {frame} is not that of the tool: a joint moves this frame against {tool}. It is not used."
                );
                Ok((None, Some(text.into())))
            }
        }
    }
}
