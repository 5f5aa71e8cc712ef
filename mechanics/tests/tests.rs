//! Requirements on the mechanics: one binary, one module for each theme.

#![allow(clippy::unwrap_used, reason = "a failed setup fails the test")]

mod support;

// The bias of the accelerometer from attitude, odometry and standstill.
mod accelerometer_bias;
// The smoother, block by block.
mod block_smoother;
// Motion of platform and wheels over the ground.
mod closed_form_motion;
// The analytic model, whatever platform and motion.
mod closed_form_properties;
// Machines that the analytic model does not describe.
mod closed_form_refusals;
// Sensitivities against dual numbers and differences.
mod derivatives;
// Measured forces of the arm against masses and motion.
mod force_watch;
// Values of the machine file in several forms, and their errors.
mod forms;
// The hydraulics of the machine file.
mod hydraulic_parameters;
// Where the IMU is mounted: machine file, URDF or log.
mod imu_mount;
// What physics demands of every result.
mod invariants;
// Four samples side by side give the bits of each alone.
mod lanes_equal_scalar;
mod lift_off;
// Measured actuator forces determine the load split.
mod measured_torques;
// Samples with a value that is not finite.
mod missing_values;
// Payloads that are weighed row by row.
mod payload_watch;
// The study of drawn parameters.
mod monte_carlo;
// Where the parts of a machine are.
mod placement;
// Loads ahead by assumed motions.
mod prediction;
// The table of quantities.
mod quantities;
// Machine files that are refused, and why.
mod refusals;
// The lines about which a machine tips.
mod tipping_lines;
// Numbers of a machine file in another unit, or none at all.
mod units_in_machine_files;
// URDFs as robots have them.
mod urdf;
// The analytic model against reference numbers.
mod val_closed_form;
// The ground wrench against Pinocchio.
mod val_newton_euler;
// The machine of the first paper against reference numbers.
mod val_petrovic_mattila;
// In which frame a log gives the wrench of the tool.
mod wrench_mount;
// Platforms whose inertia follows their actuators.
mod variable_inertia;
// A machine on any set of its supports.
mod supports;
// Stamps at the ends of their range.
mod wild_stamps;
