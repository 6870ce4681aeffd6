//! Errors of the program, as values that a command can match.

use std::fmt;
use std::path::PathBuf;

use taxel_data::BadValue;

/// Result of the functions of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// Quantity of a trade that a user can bound.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bounded {
    /// RMSE of the chosen group.
    Error,
    /// Cycles of a frame.
    Cycles,
    /// Bytes of the blob.
    Flash,
}

impl Bounded {
    /// Name of the quantity in messages.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Error => "max-error",
            Self::Cycles => "max-cycles",
            Self::Flash => "max-flash",
        }
    }
}

/// Bound of a trade, and the least value that points come down to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unmet {
    /// Bounded quantity.
    pub bounded: Bounded,
    /// Largest value that the user allows.
    pub most: f64,
    /// Whether the bound is a slot's size, which applies if no bound on flash was given.
    pub is_slot: bool,
    /// Least value of all points, or of those within the other bounds.
    pub least: f64,
}

/// Reason why no point of a trade is within its bounds.
#[derive(Debug, Clone, PartialEq)]
pub enum NoPoint {
    /// Some bounds that no point meets.
    Each {
        /// Bounds that no point meets.
        unmet: Vec<Unmet>,
        /// Unit and group of the error, such as `mm (dz_mm)`.
        unit: String,
    },
    /// Bounds that points meet one by one, but no point meets together.
    Together {
        /// All bounds, and whether any point is within all the others.
        bounds: Vec<(Unmet, bool)>,
        /// Unit and group of the error, such as `mm (dz_mm)`.
        unit: String,
    },
}

impl Unmet {
    /// Bound in words.
    fn bound(&self, name: impl Fn(Bounded) -> &'static str) -> String {
        if self.is_slot {
            format!("a slot's {} bytes", self.most)
        } else {
            format!("{} {}", name(self.bounded), self.most)
        }
    }

    /// Least value in words.
    fn least(&self, unit: &str) -> String {
        match self.bounded {
            // The error is rounded up, to a bound that can be met.
            Bounded::Error => {
                format!("the smallest error is {:.4} {unit}", (self.least * 1e4).ceil() / 1e4)
            }
            Bounded::Cycles => format!("the fewest cycles are {}", self.least),
            Bounded::Flash => format!("the smallest blob takes {} bytes", self.least),
        }
    }
}

impl std::error::Error for NoPoint {}

impl fmt::Display for NoPoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text(Bounded::name))
    }
}

impl NoPoint {
    /// Message, with bounds called by `name`.
    pub fn text(&self, name: impl Fn(Bounded) -> &'static str + Copy) -> String {
        match self {
            Self::Each { unmet, unit } => {
                let unmet: Vec<String> = unmet
                    .iter()
                    .map(|u| format!("{} ({})", u.bound(name), u.least(unit)))
                    .collect();
                format!("no point is within {}: raise the bound", unmet.join(", nor within "))
            }
            Self::Together { bounds, unit } => {
                let names: Vec<String> = bounds.iter().map(|(b, _)| b.bound(name)).collect();
                let nearest: Vec<String> = bounds
                    .iter()
                    .filter(|(_, any)| *any)
                    .map(|(b, _)| format!("without {}, {}", b.bound(name), b.least(unit)))
                    .collect();
                let (names, nearest) = (names.join(", "), nearest.join("; "));
                format!("no point is within {names} at once: {nearest}; raise one of these bounds")
            }
        }
    }
}

/// Failure of a command. Each message names the file, the place and the value, and says what would be
/// right.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Scene file that cannot be parsed.
    #[error("scene {scene}: {message}")]
    Syntax {
        /// Path or name of the scene.
        scene: String,
        /// Place in the file, and what was expected there.
        message: String,
    },
    /// Scene with a setting that cannot be used.
    #[error("scene {scene}: {cause}")]
    Scene {
        /// Path or name of the scene.
        scene: String,
        /// Setting, and which values can be used.
        cause: BadValue,
    },
    /// Setting that cannot be used.
    #[error(transparent)]
    Setting(#[from] BadValue),
    /// Data that cannot be read, written or used.
    #[error(transparent)]
    Data(#[from] taxel_data::Error),
    /// Simulation that failed.
    #[error(transparent)]
    Simulate(#[from] taxel_simulate::Error),
    /// Training or packing that failed, or a blob that was rejected.
    #[error(transparent)]
    Learn(#[from] taxel_learn::Error),
    /// Device or emulator that failed.
    #[error(transparent)]
    Rig(#[from] taxel_rig::Error),
    /// Trade without a point within its bounds.
    #[error(transparent)]
    NoPoint(#[from] NoPoint),
    /// File that is not what a command needs.
    #[error("{}: {message}", path.display())]
    Unfit {
        /// Path of the file.
        path: PathBuf,
        /// Reason, and a remedy.
        message: String,
    },
    /// Options that cannot be used, or not together.
    #[error("{0}")]
    Usage(String),
    /// Work that failed.
    #[error("{0}")]
    Failed(String),
}
