//! Predicted wheel loads of the next seconds if the motion goes on, if the platform brakes, if the arm stops.
//!
//! A [`Predictor`] extrapolates the present state by three stated motions ([`Law`]) and evaluates the states ahead by the
//! same equations as the present one. It has no memory: the same state gives the same bits, live and offline.
//!
//! ```text
//!     state now --law--> states at t_1 ... t_n --evaluate--> OTF of every wheel --> first wheel with OTF = 0, and when
//! ```
//! A prediction is a statement about an assumed motion, not about what the operator will do.

mod ahead;
mod columns;
mod decay;
mod gap;
mod instant;
mod joints;
mod law;
mod paced;
mod platform;
mod predictor;

pub use ahead::{Ahead, Prediction};
pub use columns::{
    PREDICTED, PREDICTED_AGE, PREDICTED_CAUSE, PREDICTED_GAP, PREDICTED_OTF, PREDICTED_WHEEL,
    PredictedNumber, predicted_column,
};
pub use gap::PredictionGap;
pub use law::Law;
pub use paced::PacedPredictor;
pub use predictor::Predictor;
