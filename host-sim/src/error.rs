//! What can go wrong in the program, as values that a command can match.

use std::fmt;
use std::path::PathBuf;

use taxel_data::BadValue;

/// Result of everything in this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// What a bound of a trade is on.
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
    /// Name in messages.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Error => "max-error",
            Self::Cycles => "max-cycles",
            Self::Flash => "max-flash",
        }
    }
}

/// A bound of a trade, and the least that the points come down to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unmet {
    /// What it is on.
    pub bounded: Bounded,
    /// The bound.
    pub most: f64,
    /// Whether it is a slot's size, which holds where no bound on flash was given.
    pub is_slot: bool,
    /// The least of all points, or of those within the other bounds.
    pub least: f64,
}

/// Why no point of a trade is within its bounds.
#[derive(Debug, Clone, PartialEq)]
pub enum NoPoint {
    /// Bounds that no point meets.
    Each {
        /// Those bounds.
        unmet: Vec<Unmet>,
        /// Unit and group of the error, such as `mm (dz_mm)`.
        unit: String,
    },
    /// Bounds that points meet, but none meets all of.
    Together {
        /// All bounds, and whether any point is within all the others.
        bounds: Vec<(Unmet, bool)>,
        /// Unit and group of the error, such as `mm (dz_mm)`.
        unit: String,
    },
}

impl Unmet {
    /// The bound in words.
    fn bound(&self, name: impl Fn(Bounded) -> &'static str) -> String {
        if self.is_slot {
            format!("a slot's {} bytes", self.most)
        } else {
            format!("{} {}", name(self.bounded), self.most)
        }
    }

    /// The least in words.
    fn least(&self, unit: &str) -> String {
        match self.bounded {
            // Rounded up: a bound that can be met.
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
    /// The message, with bounds called by `name`.
    pub fn text(&self, name: impl Fn(Bounded) -> &'static str + Copy) -> String {
        match self {
            Self::Each { unmet, unit } => {
                let unmet: Vec<String> = unmet
                    .iter()
                    .map(|u| format!("{}: {} of all", u.bound(name), u.least(unit)))
                    .collect();
                format!("no point is within {}: loosen it", unmet.join("; nor within "))
            }
            Self::Together { bounds, unit } => {
                let names: Vec<String> = bounds.iter().map(|(b, _)| b.bound(name)).collect();
                let nearest: Vec<String> = bounds
                    .iter()
                    .filter(|(_, any)| *any)
                    .map(|(b, _)| format!("without {}, {}", b.bound(name), b.least(unit)))
                    .collect();
                let (names, nearest) = (names.join(", "), nearest.join("; "));
                format!("no point is within {names} at once; {nearest}: loosen one")
            }
        }
    }
}

/// A failure. Each message names the file, the place and the value, and says what would be right.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A scene's file cannot be parsed.
    #[error("scene {scene}: {message}")]
    Syntax {
        /// File or name of the scene.
        scene: String,
        /// Where, and what was expected.
        message: String,
    },
    /// A scene has a setting that cannot be used.
    #[error("scene {scene}: {cause}")]
    Scene {
        /// File or name of the scene.
        scene: String,
        /// The setting.
        cause: BadValue,
    },
    /// A setting cannot be used.
    #[error(transparent)]
    Setting(#[from] BadValue),
    /// Data cannot be read, written or used.
    #[error(transparent)]
    Data(#[from] taxel_data::Error),
    /// A simulation failed.
    #[error(transparent)]
    Simulate(#[from] taxel_simulate::Error),
    /// Training or packing failed, or a blob was refused.
    #[error(transparent)]
    Learn(#[from] taxel_learn::Error),
    /// A device or an emulator failed.
    #[error(transparent)]
    Rig(#[from] taxel_rig::Error),
    /// No point of a trade is within its bounds.
    #[error(transparent)]
    NoPoint(#[from] NoPoint),
    /// The figures of `firmware/cycles.csv` cannot be used.
    #[error("firmware/cycles.csv: {0}; cargo xtask cycles --accept writes it anew")]
    Cycles(String),
    /// A file is not what a command needs.
    #[error("{}: {message}", path.display())]
    Unfit {
        /// The file.
        path: PathBuf,
        /// Why, and what to do.
        message: String,
    },
    /// Options cannot be used, or not together.
    #[error("{0}")]
    Usage(String),
    /// The work itself failed.
    #[error("{0}")]
    Failed(String),
}
