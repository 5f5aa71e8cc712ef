//! The names of joints in a message of joint states, where it lies: publishers that share a topic differ by them.

/// Bytes of the encapsulation before a message.
const ENCAPSULATION: usize = 4;
/// Seconds and nanoseconds of the header's stamp.
const STAMP_BYTES: usize = 8;

/// The names in a `sensor_msgs/msg/JointState`, in CDR with its encapsulation; `None` if it is cut off.
pub(super) fn joint_names(message: &[u8]) -> Option<Vec<&[u8]>> {
    let is_little = message.get(1)? & 1 == 1;
    let mut reader = Reader {
        data: message.get(ENCAPSULATION..)?,
        at: STAMP_BYTES,
        is_little,
    };
    // the frame of the header
    reader.text()?;
    let count = reader.length()?;
    // each name takes at least its length
    let mut names = Vec::with_capacity(count.min(message.len() / 4));
    for _ in 0..count {
        names.push(reader.text()?);
    }
    Some(names)
}

struct Reader<'m> {
    data: &'m [u8],
    at: usize,
    is_little: bool,
}

impl<'m> Reader<'m> {
    fn length(&mut self) -> Option<usize> {
        let at = self.at.next_multiple_of(4);
        let bytes: [u8; 4] = self.data.get(at..at.checked_add(4)?)?.try_into().ok()?;
        self.at = at + 4;
        let length = match self.is_little {
            true => u32::from_le_bytes(bytes),
            false => u32::from_be_bytes(bytes),
        };
        usize::try_from(length).ok()
    }

    /// Without the zero at its end.
    fn text(&mut self) -> Option<&'m [u8]> {
        let length = self.length()?;
        let text = self.data.get(self.at..self.at.checked_add(length)?)?;
        self.at += length;
        Some(text.strip_suffix(&[0]).unwrap_or(text))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A message with these names, in either order of bytes.
    fn message(names: &[&str], is_little: bool) -> Vec<u8> {
        let mut data = vec![0; STAMP_BYTES];
        let number = |number: usize| match is_little {
            true => (number as u32).to_le_bytes(),
            false => (number as u32).to_be_bytes(),
        };
        let text = |data: &mut Vec<u8>, text: &str| {
            data.resize(data.len().next_multiple_of(4), 0);
            data.extend(number(text.len() + 1));
            data.extend(text.as_bytes());
            data.push(0);
        };
        text(&mut data, "base");
        data.resize(data.len().next_multiple_of(4), 0);
        data.extend(number(names.len()));
        names.iter().for_each(|name| text(&mut data, name));
        [vec![0, u8::from(is_little), 0, 0], data].concat()
    }

    #[test]
    fn names_are_found_in_either_order_of_bytes_and_never_beyond_the_message() {
        for is_little in [true, false] {
            let message = message(&["boom", "stick_joint", ""], is_little);
            let found = joint_names(&message).unwrap();
            assert_eq!(found, [&b"boom"[..], b"stick_joint", b""]);
            for end in 0..message.len() {
                assert_eq!(joint_names(&message[..end]), None, "{end}");
            }
        }
        // a count beyond the message
        let mut long = message(&[], true);
        let end = long.len();
        long[end - 4..].fill(0xff);
        assert_eq!(joint_names(&long), None);
    }
}
