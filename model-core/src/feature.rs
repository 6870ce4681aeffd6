//! Parts of decoding that a program may be built without: each is a cargo feature of this crate.
//!
//! A type that belongs to such a part holds a [`Built`] of it. Without the part there is no value of that type, so that the
//! compiler leaves out whatever takes one.

use core::fmt::Debug;

use serde::{Deserialize, Serialize};

/// A part of decoding that a program may be built without.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Feature {
    /// Networks in the format `f32-direct`.
    F32Direct,
    /// Networks in the format `f32`.
    F32,
    /// Networks in the format `fixed16`.
    Fixed16,
    /// Confidence in outputs.
    Confidence,
    /// Filling of missing readings.
    Fill,
}

impl Feature {
    /// The cargo feature's name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::F32Direct => "f32-direct",
            Self::F32 => "f32",
            Self::Fixed16 => "fixed16",
            Self::Confidence => "confidence",
            Self::Fill => "fill",
        }
    }
}

/// Proof that a part is built.
pub trait Built: Copy + Debug + PartialEq {
    /// The proof, if the part is built.
    const PROOF: Option<Self>;
}

/// A part is built.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Yes;

/// A part is not built: there is no such value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum No {}

impl Built for Yes {
    const PROOF: Option<Self> = Some(Self);
}

impl Built for No {
    const PROOF: Option<Self> = None;
}

/// Names the proof that the part with this cargo feature is built.
macro_rules! proof {
    ($proof:ident, $feature:literal) => {
        #[doc = concat!("Proof that the part `", $feature, "` is built.")]
        #[cfg(feature = $feature)]
        pub type $proof = Yes;
        #[doc = concat!("Proof that the part `", $feature, "` is built: there is none.")]
        #[cfg(not(feature = $feature))]
        pub type $proof = No;
    };
}

proof!(F32DirectBuilt, "f32-direct");
proof!(F32Built, "f32");
proof!(Fixed16Built, "fixed16");
proof!(ConfidenceBuilt, "confidence");
proof!(FillBuilt, "fill");
