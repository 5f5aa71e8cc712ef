//! The motions that are assumed.

named! {
    /// A motion from now on.
    #[repr(u8)]
    pub enum Law {
        /// Joints and platform go on: velocities stay, accelerations die away, joints stop at their limits. A joint of which a
        /// controller asks for a rate comes to that rate.
        GoOn = 0,
        /// The platform brakes now by the stated deceleration; the arm goes on.
        BrakeNow = 1,
        /// The joints of the arm stop now by the stated decelerations; the platform goes on.
        StopArm = 2,
    }
}
