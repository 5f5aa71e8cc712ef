//! Distributes the mass of the machine to its bodies so that every axle has the load of the sheet.

mod balance;
mod finish;

use crate::body::Machine;
use crate::error::SheetError;
use crate::sheet::Sheet;

/// Determines the masses and centres of mass that the sheet's weights leave open, and the inertias.
pub(crate) fn distribute(sheet: &Sheet, machine: &mut Machine) -> Result<(), SheetError> {
    balance::balance(sheet, machine)?;
    finish::inertias(machine);
    finish::stiffness(sheet, machine);
    finish::laden(sheet, machine)
}
