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
    Cycles,
    /// Bytes of the blob.
    Flash,
    /// Frames in a second: the only bound from below.
    FrameRate,
    /// Time of scan and decoding in ms.
    Latency,
}

impl Bounded {
    /// Option of `trade` that bounds it.
    pub fn option(self) -> &'static str {
        match self {
            Self::Error => "--max-error",
            Self::Cycles => "--max-cycles",
            Self::Flash => "--max-flash",
            Self::FrameRate => "--frame-rate",
            Self::Latency => "--max-latency-ms",
        }
    }

    /// Whether `value` is within `bound`.
    pub fn allows(self, value: f64, bound: f64) -> bool {
        if self == Self::FrameRate { value >= bound } else { value <= bound }
    }

    /// The one of two values that is nearer to being within a bound.
    pub fn nearer(self, a: f64, b: f64) -> f64 {
        if self == Self::FrameRate { a.max(b) } else { a.min(b) }
    }

    /// Verb for making a bound easier to meet.
    fn relax(self) -> &'static str {
        if self == Self::FrameRate { "lower" } else { "raise" }
    }
}

/// Bound of a trade, and the nearest value that points come to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unmet {
    pub bounded: Bounded,
    /// Most, or least, that the user allows.
    pub bound: f64,
    /// Whether the bound is a slot's size, which applies if no bound on flash was given.
    pub is_slot: bool,
    /// Best value of all points, or of those within the other bounds.
    pub nearest: f64,
}

/// Reason why no point of a trade is within its bounds. It is `predicted` if it was known before anything was trained.
#[derive(Debug, Clone, PartialEq)]
pub enum NoPoint {
    /// Some bounds that no point meets.
    Each {
        /// Bounds that no point meets.
        unmet: Vec<Unmet>,
        /// Unit and group of the error, such as `mm (dz_mm)`.
        unit: String,
        /// Whether nothing was trained.
        predicted: bool,
    },
    /// Bounds that points meet one by one, but no point meets together.
    Together {
        /// All bounds, and whether any point is within all the others.
        bounds: Vec<(Unmet, bool)>,
        /// Unit and group of the error, such as `mm (dz_mm)`.
        unit: String,
        /// Whether nothing was trained.
        predicted: bool,
    },
    /// Points within the bounds, all of which have larger errors than a baseline.
    Beaten {
        /// Name of the baseline.
        decoder: String,
        /// Its error.
        least: f64,
        /// Unit and group of the error, such as `mm (dz_mm)`.
        unit: String,
    },
}

impl Unmet {
    /// Bound in words.
    fn bound(&self) -> String {
        if self.is_slot {
            format!("a slot's {} bytes", self.bound)
        } else {
            format!("{} {}", self.bounded.option(), self.bound)
        }
    }

    /// Nearest value in words, rounded to a bound that can be met. Errors and blobs that are predicted are lower bounds.
    fn nearest(&self, unit: &str, predicted: bool) -> String {
        let least = if predicted { "at least " } else { "" };
        match self.bounded {
            Bounded::Error => {
                format!(
                    "the smallest error is {least}{:.4} {unit}",
                    (self.nearest * 1e4).ceil() / 1e4
                )
            }
            Bounded::Cycles => format!("the fewest cycles are {}", self.nearest),
            Bounded::Flash => format!("the smallest blob takes {least}{} bytes", self.nearest),
            Bounded::FrameRate => {
                let most = (self.nearest * 10.0).floor() / 10.0;
                format!("the highest rate is {most:.1} frames a second")
            }
            Bounded::Latency => {
                format!("the shortest time is {:.3} ms", (self.nearest * 1e3).ceil() / 1e3)
            }
        }
    }
}

impl std::error::Error for NoPoint {}

impl fmt::Display for NoPoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let untrained = |predicted: bool| if predicted { "; nothing was trained" } else { "" };
        match self {
            Self::Each { unmet, unit, predicted } => {
                let verb = match unmet.as_slice() {
                    [first, rest @ ..]
                        if rest.iter().all(|u| u.bounded.relax() == first.bounded.relax()) =>
                    {
                        first.bounded.relax()
                    }
                    _ => "relax",
                };
                let plural = if unmet.len() == 1 { "" } else { "s" };
                let unmet: Vec<String> = unmet
                    .iter()
                    .map(|u| format!("{} ({})", u.bound(), u.nearest(unit, *predicted)))
                    .collect();
                let (unmet, untrained) = (unmet.join(", nor within "), untrained(*predicted));
                write!(f, "no point is within {unmet}: {verb} the bound{plural}{untrained}")
            }
            Self::Together { bounds, unit, predicted } => {
                let names: Vec<String> = bounds.iter().map(|(b, _)| b.bound()).collect();
                let nearest: Vec<String> = bounds
                    .iter()
                    .filter(|(_, any)| *any)
                    .map(|(b, _)| format!("without {}, {}", b.bound(), b.nearest(unit, *predicted)))
                    .collect();
                let (names, nearest) = (names.join(", "), nearest.join("; "));
                let untrained = untrained(*predicted);
                write!(
                    f,
                    "no point is within {names} at once: {nearest}; relax one of these bounds{untrained}"
                )
            }
            Self::Beaten { decoder, least, unit } => write!(
                f,
                "no model within the bounds is worth its cost: the baseline {decoder} has an error of {least:.4} {unit}, \
                 which is smaller"
            ),
        }
    }
}

/// Failure of a command. Each message names the file, the place and the value, and says what would be
/// right.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Refusal or failure of the crates that compute.
    #[error(transparent)]
    Data(#[from] taxel_data::Error),
    /// Device that failed, other than by a refusal or failure of [`Data`](Self::Data).
    #[error(transparent)]
    Rig(taxel_rig::Error),
    /// Trade without a point within its bounds.
    #[error(transparent)]
    NoPoint(#[from] NoPoint),
    /// File that is not what a command needs.
    #[error("{}: {message}", path.display())]
    Unfit {
        path: PathBuf,
        /// Reason, and a remedy.
        message: String,
    },
    /// Options that cannot be used, or not together.
    #[error("{0}")]
    Usage(String),
}

impl Error {
    /// Error for work that failed, and the `reason`.
    pub fn failed(reason: impl Into<String>) -> Self {
        taxel_data::Error::failed(reason).into()
    }

    /// Error for a scene with this name or path, and what is wrong with it.
    pub fn of_scene(scene: &str, cause: impl fmt::Display) -> Self {
        taxel_data::Error::unfit(format!("scene {scene}: {cause}")).into()
    }
}

impl From<BadValue> for Error {
    fn from(bad: BadValue) -> Self {
        Self::Data(bad.into())
    }
}

impl From<taxel_rig::Error> for Error {
    fn from(error: taxel_rig::Error) -> Self {
        match error {
            taxel_rig::Error::Data(error) => Self::Data(error),
            error => Self::Rig(error),
        }
    }
}
