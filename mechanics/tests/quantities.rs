//! The table of quantities: one name, one unit, one meaning each.

use std::collections::BTreeSet;

use crate::support::machine;
use tipwatch_mechanics::{ColumnNames, Quantity, RowColumn, Scope};

const EVERYTHING: Scope = Scope {
    parts: true,
    terms: true,
    ..Scope::ALL
};

#[test]
fn every_kind_has_pattern_unit_label_and_meaning() {
    for kind in Quantity::KINDS {
        for text in [kind.pattern, kind.unit, kind.label, kind.meaning] {
            assert!(!text.is_empty() && text == text.trim(), "{kind:?}");
        }
        assert!(!kind.meaning.ends_with('.'), "{kind:?}");
    }
}

#[test]
fn columns_have_unique_names() {
    let rows = RowColumn::BEFORE.into_iter().chain(RowColumn::AFTER);
    for name in ["rigid", "petrovic_mattila"] {
        let machine = machine(name);
        let names = ColumnNames::of(&machine);
        let quantities = Quantity::all(&machine, EVERYTHING).into_iter();
        let mut columns: Vec<_> = quantities.map(|quantity| quantity.column(&names)).collect();
        columns.extend(rows.clone().map(|column| column.name.to_string()));
        let distinct: BTreeSet<_> = columns.iter().collect();
        assert_eq!(distinct.len(), columns.len(), "{columns:?}");
        assert!(columns.iter().all(|column| !column.contains(['{', '}'])));
    }
    let kinds: BTreeSet<_> = Quantity::KINDS.iter().map(|kind| kind.pattern).collect();
    assert_eq!(kinds.len(), Quantity::KINDS.len());
}

#[test]
fn a_quantity_belongs_to_the_kind_of_its_variant() {
    let machine = machine("rigid");
    for quantity in Quantity::all(&machine, EVERYTHING) {
        let variant = format!("{quantity:?}");
        let variant = variant.split('(').next();
        assert_eq!(Some(quantity.kind().variant), variant);
    }
}
