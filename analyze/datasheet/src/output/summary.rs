//! The summary for a terminal.

use std::fmt::Write;

use crate::body::Machine;

impl Machine {
    /// Masses, axle loads, reach, and everything that was assumed.
    #[must_use]
    pub fn summary(&self) -> String {
        let mut out = String::new();
        let [x, y, z] = self.centre_of_mass.map(|c| (c * 1e3).round() * 1e-3 + 0.0);
        let _ = writeln!(out, "{} ({})", self.name, self.template.title());
        let _ = writeln!(
            out,
            "mass {:.0} kg, centre of mass at x {x:.3}, y {y:.3}, z {z:.3} m",
            self.mass
        );
        for (index, axle) in self.axles.iter().enumerate() {
            if let Some(load) = axle.load {
                let source = if axle.is_stated { "sheet" } else { "assumed" };
                let _ = writeln!(
                    out,
                    "axle {} at x {:.3} m: {load:.0} kg ({source})",
                    index + 1,
                    axle.x
                );
            }
        }
        let _ = writeln!(out, "reach of the arm {:.2} m", self.reach);
        for note in &self.notes {
            let _ = writeln!(out, "note: {note}");
        }
        let _ = writeln!(out, "{} values were assumed:", self.assumptions.len());
        for assumption in &self.assumptions {
            let _ = writeln!(out, "- {assumption}");
        }
        out
    }
}
