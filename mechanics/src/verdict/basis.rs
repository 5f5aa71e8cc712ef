//! Evidence behind a verdict.

named! {
    /// What a verdict stands on: only what is proven may be called safe.
    #[derive(PartialOrd, Ord, Default)]
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
}

impl Basis {
    /// The basis with this number; doubted for an unknown one.
    #[must_use]
    pub fn from_number(number: u32) -> Self {
        let is_it = |basis: &Self| *basis as u32 == number;
        Self::ALL.into_iter().find(is_it).unwrap_or_default()
    }
}
