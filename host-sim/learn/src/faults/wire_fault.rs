//! A fault: its wires, and what is wrong with them.

use std::fmt;

use serde::{Serialize, Serializer};
use taxel_core::health::Fault;

/// Wires of a fault, numbered as their names are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Place {
    /// All wires.
    All,
    /// A row-wire.
    Row(usize),
    /// Two neighbouring row-wires.
    Rows(usize, usize),
    /// A column-wire.
    Column(usize),
    /// Two neighbouring column-wires.
    Columns(usize, usize),
    /// The reading of a row-wire and a column-wire.
    Reading(usize, usize),
}

impl Place {
    /// Whether the reading of `row` and `column` belongs to the place.
    pub fn holds(self, row: usize, column: usize) -> bool {
        match self {
            Self::All => true,
            Self::Row(wire) => wire == row,
            Self::Rows(a, b) => [a, b].contains(&row),
            Self::Column(wire) => wire == column,
            Self::Columns(a, b) => [a, b].contains(&column),
            Self::Reading(of_row, of_column) => (of_row, of_column) == (row, column),
        }
    }
}

/// What is wrong with wires.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// No reading could be taken.
    Missing,
    /// No current flows: broken or not connected; or the converter is stuck at its lower end.
    Open,
    /// The circuit is saturated: the resistance is too small to be measured, or shorted; or the converter is stuck at its
    /// upper end.
    Shorted,
    /// Missing, because a reading of the row-wire is shorted: nobody knows how far the row's voltage drops.
    BesideShort,
    /// Connected to ground, which a row-wire shows by saturating all others.
    AtGround,
    /// Connected with each other.
    Touching,
    /// Missing in some frames, and back in others.
    IntermittentlyMissing,
    /// Open in some frames, and closed in others: a loose contact.
    IntermittentlyOpen,
    /// Shorted in some frames, and sound in others.
    IntermittentlyShorted,
    /// Far off what the other readings tell.
    Noisy,
}

impl Kind {
    /// Fault that the health of the place's readings has; `None` if they are within the limits.
    pub fn of_readings(self) -> Option<Fault> {
        match self {
            Self::Missing | Self::BesideShort | Self::IntermittentlyMissing => Some(Fault::Missing),
            Self::Open | Self::AtGround | Self::IntermittentlyOpen => Some(Fault::Open),
            Self::Shorted | Self::IntermittentlyShorted => Some(Fault::Shorted),
            Self::Touching | Self::Noisy => None,
        }
    }

    /// What readings have that are faulty in all frames.
    pub(super) fn lasting(fault: Fault) -> Self {
        match fault {
            Fault::Missing => Self::Missing,
            Fault::Shorted => Self::Shorted,
            Fault::Open => Self::Open,
        }
    }

    /// What readings have that are faulty in some frames, and sound in others.
    pub(super) fn intermittent(fault: Fault) -> Self {
        match fault {
            Fault::Missing => Self::IntermittentlyMissing,
            Fault::Shorted => Self::IntermittentlyShorted,
            Fault::Open => Self::IntermittentlyOpen,
        }
    }
}

/// What is wrong, and where.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct WireFault {
    /// Wires that it strikes.
    pub place: Place,
    /// What is wrong with them.
    pub kind: Kind,
}

impl fmt::Display for WireFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.place {
            Place::All => write!(f, "all readings"),
            Place::Row(wire) => write!(f, "row-wire {wire}"),
            Place::Rows(a, b) => write!(f, "row-wires {a} and {b}"),
            Place::Column(wire) => write!(f, "column-wire {wire}"),
            Place::Columns(a, b) => write!(f, "column-wires {a} and {b}"),
            Place::Reading(row, column) => write!(f, "r{row}c{column}"),
        }?;
        f.write_str(match self.kind {
            Kind::Missing => " missing",
            Kind::Open => " open",
            Kind::Shorted => " shorted (or too small)",
            Kind::BesideShort => " unknown beside a short",
            Kind::AtGround => " shorted to ground",
            Kind::Touching => " shorted together",
            Kind::IntermittentlyMissing => " intermittently missing",
            Kind::IntermittentlyOpen => " intermittently open",
            Kind::IntermittentlyShorted => " intermittently shorted",
            Kind::Noisy => " noisy",
        })
    }
}

impl Serialize for WireFault {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}
