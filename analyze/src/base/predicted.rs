//! Predictions of the rows, in columns.

use tipwatch_mechanics::Contribution;
use tipwatch_mechanics::prediction::{Ahead, Law, PredictedNumber, Prediction, PredictionGap};

/// The predictions of consecutive rows, by [`Law`].
#[derive(Debug, Clone)]
pub struct Predictions {
    laws: [LawColumns; Law::ALL.len()],
    /// Time since the rows for which the predictions were made (s).
    pub age_s: Vec<f64>,
}

/// Predictions under one assumed motion, row by row.
#[derive(Debug, Clone, Default)]
pub struct LawColumns {
    numbers: [Vec<f64>; PredictedNumber::ALL.len()],
    /// Smallest OTF within the horizon, by wheel and row (N).
    pub otf_least: Vec<Vec<f64>>,
    /// Index of the wheel that lifts first or comes closest to it.
    pub wheels: Vec<Option<usize>>,
    /// Contribution that takes most load off that wheel.
    pub causes: Vec<Option<Contribution>>,
    /// Reason why nothing is predicted.
    pub gaps: Vec<Option<PredictionGap>>,
}

impl Predictions {
    /// No rows of a machine with this number of wheels.
    #[must_use]
    pub fn none(wheels: usize) -> Self {
        let law = LawColumns {
            otf_least: vec![Vec::new(); wheels],
            ..LawColumns::default()
        };
        Self {
            laws: std::array::from_fn(|_| law.clone()),
            age_s: Vec::new(),
        }
    }

    /// The columns of a law.
    #[must_use]
    pub fn of(&self, law: Law) -> &LawColumns {
        &self.laws[law as usize]
    }

    pub(super) fn push(&mut self, prediction: &Prediction) {
        for (columns, ahead) in self.laws.iter_mut().zip(&prediction.ahead) {
            columns.push(ahead);
        }
        self.age_s.push(prediction.age_s);
    }

    pub(super) fn append(&mut self, next: Self) {
        for (columns, next) in self.laws.iter_mut().zip(next.laws) {
            columns.append(next);
        }
        self.age_s.extend(next.age_s);
    }
}

impl LawColumns {
    /// A number of all rows; NaN where it is unknown.
    #[must_use]
    pub fn number(&self, number: PredictedNumber) -> &[f64] {
        &self.numbers[number as usize]
    }

    fn push(&mut self, ahead: &Ahead) {
        for (column, number) in self.numbers.iter_mut().zip(PredictedNumber::ALL) {
            column.push(number.of(ahead));
        }
        for (column, &otf) in self.otf_least.iter_mut().zip(&ahead.otf_least) {
            column.push(otf);
        }
        self.wheels.push(ahead.wheel);
        self.causes.push(ahead.cause);
        self.gaps.push(ahead.gap);
    }

    fn append(&mut self, next: Self) {
        let numbers = self.numbers.iter_mut().zip(next.numbers);
        let loads = self.otf_least.iter_mut().zip(next.otf_least);
        numbers
            .chain(loads)
            .for_each(|(column, next)| column.extend(next));
        self.wheels.extend(next.wheels);
        self.causes.extend(next.causes);
        self.gaps.extend(next.gaps);
    }
}
