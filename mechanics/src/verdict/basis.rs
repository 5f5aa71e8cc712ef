//! What a verdict stands on.

/// What a verdict stands on: only what is proven may be called safe.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Default,
    strum::EnumCount,
    strum::EnumMessage,
    strum::IntoStaticStr,
    strum::VariantArray,
)]
#[strum(serialize_all = "snake_case")]
#[repr(u8)]
pub enum Basis {
    /// Signals are missing, have failed or contradict each other, or too little is known.
    #[default]
    Doubted = 0,
    /// Nothing contradicts the signals, but not everything that the loads hang on has been proven.
    Assumed = 1,
    /// A commissioning of this machine file, or the motion of this session, has shown every signal that the loads hang on, and
    /// the split of the load does not rest on unknown ground.
    Proven = 2,
}

impl Basis {
    /// All of them, in order.
    pub const ALL: [Self; <Self as strum::EnumCount>::COUNT] =
        *<Self as strum::VariantArray>::VARIANTS
            .first_chunk()
            .expect("all variants");

    /// Name in tables and messages.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// The basis with this number; doubted for an unknown one.
    #[must_use]
    pub fn from_number(number: u32) -> Self {
        let is_it = |basis: &Self| *basis as u32 == number;
        Self::ALL.into_iter().find(is_it).unwrap_or_default()
    }
}
