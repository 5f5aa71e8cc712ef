//! The kinds of implausible signals that a machine file sets policies for.

named! {
    /// Kind of a fault.
    #[derive(PartialOrd, Ord)]
    pub enum FaultKind {
        /// A NaN or an infinite value.
        NotFinite,
        /// A value outside the range of such a sensor.
        OutOfRange,
        /// One axis repeats its largest or least value: the end of its sensor's range.
        Saturated,
        /// A joint position beyond the limits of the URDF.
        JointLimit,
        /// A velocity, or a change between consecutive samples, that is physically impossible.
        ImpossibleRate,
        /// One sample far from those around it. It is left out, and the estimate bridges it.
        Outlier,
        /// Identical raw values repeat where noise is expected or motion is detected elsewhere.
        Frozen,
        /// A quaternion of non-unit norm.
        NotUnit,
        /// Two measurements of the same quantity disagree: a joint's velocity with its position, or an IMU's
        /// attitude with the measured gravity.
        Disagreement,
        /// Two sensors that measure different quantities contradict each other by the mechanics of the machine.
        Contradiction,
    }
}
