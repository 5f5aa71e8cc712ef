//! Messages in CDR (Common Data Representation), the encoding of ROS 2: little endian, every number aligned
//! to its own size.

/// A message in progress.
#[derive(Debug)]
pub(crate) struct Cdr(Vec<u8>);

/// Encapsulation before every message: plain CDR, little endian.
const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

impl Cdr {
    pub(crate) fn with_capacity(bytes: usize) -> Self {
        let mut message = Vec::with_capacity(bytes);
        message.extend_from_slice(&ENCAPSULATION);
        Self(message)
    }

    pub(crate) fn finish(self) -> Vec<u8> {
        self.0
    }

    fn align(&mut self, size: usize) {
        let at = self.0.len() - ENCAPSULATION.len();
        let padding = at.next_multiple_of(size) - at;
        self.0.resize(self.0.len() + padding, 0);
    }

    pub(crate) fn u8(&mut self, number: u8) {
        self.0.push(number);
    }

    pub(crate) fn u32(&mut self, number: u32) {
        self.align(4);
        self.0.extend_from_slice(&number.to_le_bytes());
    }

    pub(crate) fn u64(&mut self, number: u64) {
        self.align(8);
        self.0.extend_from_slice(&number.to_le_bytes());
    }

    pub(crate) fn i64(&mut self, number: i64) {
        self.align(8);
        self.0.extend_from_slice(&number.to_le_bytes());
    }

    pub(crate) fn f64(&mut self, number: f64) {
        self.align(8);
        self.0.extend_from_slice(&number.to_le_bytes());
    }

    pub(crate) fn f64s(&mut self, numbers: &[f64]) {
        numbers.iter().for_each(|&number| self.f64(number));
    }

    /// A list of variable length.
    pub(crate) fn list(&mut self, numbers: &[f64]) {
        self.u32(numbers.len() as u32);
        self.f64s(numbers);
    }

    pub(crate) fn text(&mut self, text: &str) {
        self.u32(text.len() as u32 + 1);
        self.0.extend_from_slice(text.as_bytes());
        self.0.push(0);
    }

    /// A header: time and frame.
    pub(crate) fn header(&mut self, stamp_ns: i64, frame: &str) {
        const SECOND_NS: i64 = 1_000_000_000;
        // the guard rejects other seconds; a verdict before the first row has none
        let seconds = i32::try_from(stamp_ns.div_euclid(SECOND_NS)).unwrap_or(0);
        self.u32(seconds.cast_unsigned());
        self.u32(stamp_ns.rem_euclid(SECOND_NS) as u32);
        self.text(frame);
    }
}
