//! The numbers of a prediction as columns of tables: names, units and meanings.

use super::ahead::Ahead;
use super::law::Law;
use crate::evaluate::quantities::RowColumn;

/// A number that is predicted for each [`Law`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, strum::EnumCount, strum::VariantArray)]
pub enum PredictedNumber {
    /// [`Ahead::lift_off_s`].
    LiftOff,
    /// [`Ahead::earliest_s`].
    Earliest,
    /// [`Ahead::latest_s`].
    Latest,
    /// [`Ahead::utilisation`].
    Utilisation,
}

/// The columns of a prediction, one of each for every law but the age: `{law}` stands for its name, `{wheel}` for that of a wheel in lower
/// case.
pub const PREDICTED: [RowColumn; 9] = [
    RowColumn {
        name: "predicted_{law}_lift_off",
        unit: "s",
        meaning: "Time until a wheel lifts under the assumed motion, by the computed OTF; 0 if it has lifted; null if none lifts within the horizon",
    },
    RowColumn {
        name: "predicted_{law}_earliest",
        unit: "s",
        meaning: "The same for the OTF less two standard deviations: lift-off is possible from then on; null beyond the horizon",
    },
    RowColumn {
        name: "predicted_{law}_latest",
        unit: "s",
        meaning: "The same for the OTF plus two standard deviations of that wheel; null beyond the horizon",
    },
    RowColumn {
        name: "predicted_{law}_utilisation",
        unit: "-",
        meaning: "Utilisation at the first instant ahead with a lifted wheel; if there is none, at the one with the smallest OTF relative to the static load",
    },
    RowColumn {
        name: "predicted_{law}_otf_{wheel}_min",
        unit: "N",
        meaning: "Smallest OTF within the horizon; signed as `otf_<wheel>`",
    },
    RowColumn {
        name: "predicted_{law}_wheel",
        unit: "",
        meaning: "The wheel that lifts first; if none lifts, the one that comes closest",
    },
    RowColumn {
        name: "predicted_{law}_cause",
        unit: "",
        meaning: "The [cause](#causes) that takes most load off that wheel until then",
    },
    RowColumn {
        name: "predicted_{law}_gap",
        unit: "",
        meaning: "Why nothing is predicted; null if something is",
    },
    RowColumn {
        name: "predicted_age",
        unit: "s",
        meaning: "Time since the row for which the prediction was made; 0 if it was made for this row. Only at level Safe and only a prediction by which no wheel may lift is repeated; null where nothing is predicted by any motion",
    },
];

/// Name of the column of a law, from the name in [`PREDICTED`].
#[must_use]
pub fn predicted_column(pattern: &RowColumn, law: Law) -> String {
    pattern.name.replace("{law}", law.name())
}

impl PredictedNumber {
    /// All of them, in order.
    pub const ALL: [Self; <Self as strum::EnumCount>::COUNT] =
        *<Self as strum::VariantArray>::VARIANTS
            .first_chunk()
            .expect("all variants");

    /// Name, unit and meaning.
    #[must_use]
    pub fn column(self) -> &'static RowColumn {
        &PREDICTED[self as usize]
    }

    /// The number of a prediction.
    #[must_use]
    pub fn of(self, ahead: &Ahead) -> f64 {
        match self {
            Self::LiftOff => ahead.lift_off_s,
            Self::Earliest => ahead.earliest_s,
            Self::Latest => ahead.latest_s,
            Self::Utilisation => ahead.utilisation,
        }
    }
}

/// Name, unit and meaning of [`Ahead::otf_least`].
pub const PREDICTED_OTF: &RowColumn = &PREDICTED[4];
/// Name and meaning of [`Ahead::wheel`].
pub const PREDICTED_WHEEL: &RowColumn = &PREDICTED[5];
/// Name and meaning of [`Ahead::cause`].
pub const PREDICTED_CAUSE: &RowColumn = &PREDICTED[6];
/// Name and meaning of [`Ahead::gap`].
pub const PREDICTED_GAP: &RowColumn = &PREDICTED[7];
/// Name, unit and meaning of [`Prediction::age_s`](super::Prediction::age_s).
pub const PREDICTED_AGE: &RowColumn = &PREDICTED[8];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_the_numbers() {
        for (number, name) in [
            (PredictedNumber::LiftOff, "lift_off"),
            (PredictedNumber::Earliest, "earliest"),
            (PredictedNumber::Latest, "latest"),
            (PredictedNumber::Utilisation, "utilisation"),
        ] {
            let column = predicted_column(number.column(), Law::StopArm);
            assert_eq!(column, format!("predicted_stop_arm_{name}"));
        }
        assert!(PREDICTED_OTF.name.contains("otf"));
        assert!(PREDICTED_WHEEL.name.ends_with("wheel") && PREDICTED_CAUSE.name.ends_with("cause"));
        assert!(PREDICTED_GAP.name.ends_with("gap"));
        assert!(PREDICTED_AGE.name.ends_with("age"));
    }
}
