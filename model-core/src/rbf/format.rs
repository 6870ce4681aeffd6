//! The number formats of networks.

/// How a network's numbers and distances are represented.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// [`direct`](super::direct): f32, distances from differences.
    F32Direct,
    /// [`expanded`](super::expanded): f32, distances from products.
    F32,
    /// [`fixed16`](super::fixed16): 16-bit fixed point.
    Fixed16,
}

impl Format {
    /// Every format.
    pub const ALL: [Self; 3] = [Self::F32Direct, Self::F32, Self::Fixed16];

    /// The format's name, as users choose it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::F32Direct => "f32-direct",
            Self::F32 => "f32",
            Self::Fixed16 => "fixed16",
        }
    }
}
