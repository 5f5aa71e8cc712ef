//! Which loads of a machine a sensor measures.

use super::{LoadSensor, Machine};

impl LoadSensor {
    /// Returns the places of the sensor's supports that are on the ground in the lists by wheel of `machine`. The others carry
    /// nothing.
    pub fn places<'a>(&'a self, machine: &'a Machine) -> impl Iterator<Item = usize> + 'a {
        self.supports.iter().filter_map(|&id| machine.place_of(id))
    }

    /// The computed load that it measures (N), from those of the supports that `machine` stands on; `None` if all of its
    /// supports are off the ground.
    #[must_use]
    pub fn of(&self, machine: &Machine, loads: &[f64]) -> Option<f64> {
        let mut places = self.places(machine).peekable();
        places.peek()?;
        Some(places.map(|place| loads[place]).sum())
    }

    /// Returns the factors of the loads by wheel of `machine` in the sensor's measurement.
    #[must_use]
    pub fn factors(&self, machine: &Machine) -> Vec<f64> {
        let mut factors = vec![0.0; machine.wheels().len()];
        for place in self.places(machine) {
            factors[place] = 1.0;
        }
        factors
    }
}
