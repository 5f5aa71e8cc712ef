//! Refusal of a session: a number on the wire, and a text.

use crate::wire::topics::{TEXT_BYTES, Wire, WireRefusal};

tipwatch_mechanics::named! {
    /// Kind of reason; the numbers are part of the wire.
    #[derive(strum::FromRepr)]
    #[repr(u32)]
    pub enum Refusal {
        /// The announcement is damaged, of another version, or contradicts itself.
        Damaged = 1,
        /// Another machine file or URDF.
        OtherMachine = 2,
        /// Its clock is unrelated to real time.
        Untimed = 3,
        /// A sensor that the machine file binds is missing.
        SensorMissing = 4,
        /// A sensor that the machine does not have.
        SensorUnknown = 5,
        /// A joint is missing, unknown or listed twice.
        Joints = 6,
        /// The mounting of the IMU is unknown, or its frame contradicts the machine file.
        ImuMounting = 7,
        /// The machine does not suit live use.
        Unsuitable = 8,
    }
}

/// The error of a session that is refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{text}")]
pub struct SessionRefused {
    /// The kind of reason.
    pub reason: Refusal,
    /// Text for people: what was expected, and what was found.
    pub text: String,
}

impl Refusal {
    /// The error with this reason.
    #[must_use]
    pub fn because(self, text: impl Into<String>) -> SessionRefused {
        SessionRefused {
            reason: self,
            text: text.into(),
        }
    }
}

impl SessionRefused {
    /// Converts the error of opening a session to the refusal of the session.
    #[must_use]
    pub fn of(error: &anyhow::Error) -> Self {
        let known = error.downcast_ref::<Self>().map(|refused| refused.reason);
        Self {
            reason: known.unwrap_or(Refusal::Unsuitable),
            text: format!("{error:#}"),
        }
    }
}

impl WireRefusal {
    /// The message of a refused session, without head. A text that is too long is cut.
    #[must_use]
    pub fn new(session: u64, refused: &SessionRefused) -> Self {
        let mut end = refused.text.len().min(TEXT_BYTES - 1);
        while !refused.text.is_char_boundary(end) {
            end -= 1;
        }
        let mut wire = Self {
            session,
            reason: refused.reason as u32,
            ..Self::blank()
        };
        let text = refused.text.as_bytes().iter().take(end);
        for (to, &byte) in wire.text.iter_mut().zip(text) {
            // a zero would end the text
            *to = if byte == 0 { b' ' } else { byte };
        }
        wire
    }

    /// The reason as text.
    #[must_use]
    pub fn text(&self) -> String {
        let bytes = self.text.split(|&byte| byte == 0).next();
        String::from_utf8_lossy(bytes.unwrap_or_default()).into_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::topics::WireVerdict;

    #[test]
    fn long_texts_are_cut_between_characters() {
        let refused = Refusal::Joints.because("é".repeat(400));
        let text = WireRefusal::new(7, &refused).text();
        assert_eq!(text, "é".repeat(255));
    }

    #[test]
    fn documented_reasons_are_those_of_the_wire() {
        let field = WireVerdict::FIELDS.iter().find(|f| f.name == "refusal");
        let doc = field.unwrap().doc.join(" ");
        for reason in Refusal::ALL {
            assert!(doc.contains(&format!(" {} ", reason as u32)), "{reason:?}");
        }
    }
}
