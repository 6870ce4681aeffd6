//! Scenes: what is simulated, and nothing beyond it.
//!
//! A scene is a TOML file; `docs/scenes.md` explains every field. [`Scene::load`] reads and checks
//! it; what it returns can be used without further checks.

use std::path::Path;

use serde::Deserialize;

use crate::error::{Error, Result};
use crate::number_format::NumberFormat;
use crate::sensor::{self, Axis, Precision, Sensor, Vector3};

mod file;
mod names;
mod readout;
mod validate;

pub use names::deformation_names;
pub use readout::{Circuit, Drive, Readout, Sampler};

/// Scenes that are part of the program, by name.
pub const EMBEDDED: [(&str, &str); 2] = [
    ("paper", include_str!("../../scenes/paper.toml")),
    ("press", include_str!("../../scenes/press.toml")),
];

/// A checked scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Names the output folder and the model.
    pub name: String,
    /// CRC-64/XZ of the scene's text.
    pub digest: u64,
    /// Seed of every random draw.
    pub seed: u64,
    /// How precisely readings are computed.
    pub precision: Precision,
    /// Geometry and material.
    pub sensor: Sensor,
    /// What moves.
    pub deformation: Deformation,
    /// What disturbs the readings.
    pub noise: Noise,
    /// Row-wires that are read, from 0, ascending.
    pub read_rows: Vec<usize>,
    /// How they are read.
    pub readout: Readout,
    /// Which outputs are wanted.
    pub outputs: Outputs,
    /// How the model is trained.
    pub training: Training,
    /// How Table 1 is computed, if it is wanted.
    pub table1: Option<Table1>,
}

/// How electrodes move. Ranges are uniform distributions.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
pub enum Deformation {
    /// Every electrode on its own.
    Independent {
        /// Range of Δx in mm.
        dx_mm: [f64; 2],
        /// Range of Δy in mm.
        dy_mm: [f64; 2],
        /// Range of Δz in mm.
        dz_mm: [f64; 2],
    },
    /// One contact, centred anywhere on the face: Δz = d·exp(−ρ²/2s²), sheared by
    /// (Δx, Δy) = μ·Δz·(cos θ, sin θ), θ uniform on the circle.
    Press {
        /// Range of the dent's radius s in mm.
        dent_radius_mm: [f64; 2],
        /// Range of its depth d in mm.
        dent_depth_mm: [f64; 2],
        /// Range of the shear ratio μ.
        shear_ratio: [f64; 2],
    },
}

/// White Gaussian noise on the readings, with a normal n for every reading of every frame.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Noise {
    /// How the level is meant.
    pub kind: NoiseKind,
    /// Level p, as a fraction: 0.005 is 0.5 %.
    pub level: f64,
}

/// How a noise level is meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum NoiseKind {
    /// R·(1 + p·n).
    Relative,
    /// R + p·(channel maximum − minimum over the scene)·n.
    Span,
}

/// What a model gives out, for every electrode of the rows that are read.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Outputs {
    /// Deformation in mm or force in N.
    pub quantity: Quantity,
    /// Which components.
    pub axes: Vec<Axis>,
}

/// The quantity that outputs measure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Quantity {
    /// Δ, in mm.
    Deformation,
    /// F = diag(kx, ky, kz)·Δ, in N.
    Force,
}

/// How the model is trained.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Training {
    /// Frames to train on.
    pub frames: usize,
    /// Frames to evaluate on.
    pub test_frames: usize,
    /// Centres of each row's network, K.
    pub centres: usize,
    /// Width σ on scaled inputs.
    pub spread: f64,
    /// Whether A·x is added.
    pub affine_tail: bool,
    /// How numbers are represented.
    #[serde(default)]
    pub format: NumberFormat,
    /// One network for all rows, behind a projection of all readings, instead of one a row.
    #[serde(default)]
    pub whole_array: bool,
}

/// How Table 1 of the paper is computed.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Table1 {
    /// Spreads, one a line of the table.
    pub spreads: Vec<f64>,
    /// Noise levels, one a column.
    pub noise_levels: Vec<f64>,
    /// Frames to train each cell on.
    pub frames: usize,
    /// Frames to evaluate each cell on.
    pub test_frames: usize,
    /// Centres of each row's network, K.
    pub centres: usize,
    /// Whether A·x is added (the paper's network has no such tail).
    pub affine_tail: bool,
    /// Frames, and centres, of the standard network (K = N).
    pub standard_frames: usize,
}

impl Scene {
    /// Reads a scene: the name of an embedded one, or a path.
    ///
    /// # Errors
    /// [`Error::Read`] or [`Error::Scene`], naming the field, its value and the fix.
    pub fn load(name_or_path: &str) -> Result<Self> {
        if let Some((_, text)) = EMBEDDED.iter().find(|(name, _)| *name == name_or_path) {
            return Self::parse(name_or_path, text);
        }
        let path = Path::new(name_or_path);
        let text = std::fs::read_to_string(path).map_err(|cause| {
            let names: Vec<_> = EMBEDDED.iter().map(|(name, _)| *name).collect();
            let known = names.join(", ");
            let hint = format!("{cause}; built-in scenes are: {known}");
            Error::read(path, std::io::Error::new(cause.kind(), hint))
        })?;
        Self::parse(name_or_path, &text)
    }

    /// Reads a scene from its text; `origin` names it in messages.
    ///
    /// # Errors
    /// [`Error::Scene`].
    pub fn parse(origin: &str, text: &str) -> Result<Self> {
        let error = |message| Error::Scene { scene: origin.into(), message };
        let file: file::SceneFile =
            toml::from_str(text).map_err(|e| error(e.to_string().trim_end().to_owned()))?;
        let scene = file.into_scene(crate::digest::digest(text.as_bytes()));
        validate::validate(&scene).map_err(error)?;
        Ok(scene)
    }

    /// Changes the noise level.
    ///
    /// # Errors
    /// [`Error::Usage`] for a level that is no fraction.
    pub fn set_noise_level(&mut self, level: f64) -> Result<()> {
        validate::noise_level("noise level", level).map_err(Error::Usage)?;
        self.noise.level = level;
        Ok(())
    }

    /// Checks that so many `frames` fit in memory; `option` names them in the message.
    ///
    /// # Errors
    /// [`Error::Usage`].
    pub fn check_frames(&self, option: &str, frames: usize) -> Result<()> {
        validate::size(self, option, frames).map_err(Error::Usage)
    }

    /// Extreme deformation of any electrode along each axis, in mm: `[axis][low, high]`.
    #[must_use]
    pub fn deformation_range_mm(&self) -> [[f64; 2]; 3] {
        match self.deformation {
            Deformation::Independent { dx_mm, dy_mm, dz_mm } => [dx_mm, dy_mm, dz_mm],
            Deformation::Press { dent_depth_mm: [_, depth], shear_ratio: [_, ratio], .. } => {
                let shear = depth * ratio;
                [[-shear, shear], [-shear, shear], [0.0, depth]]
            }
        }
    }

    /// Full scale of the outputs along each axis, in the outputs' unit: the largest deformation
    /// magnitude that the scene can produce, 1 mm in both reference scenes for z.
    #[must_use]
    pub fn full_scale(&self, axis: Axis) -> f64 {
        // One full scale for all axes, as the paper has it: that of the largest deformation.
        let largest_mm =
            self.deformation_range_mm().as_flattened().iter().fold(0.0_f64, |a, b| a.max(b.abs()));
        match self.outputs.quantity {
            Quantity::Deformation => largest_mm,
            Quantity::Force => largest_mm * self.sensor.stiffness_n_per_mm[axis.index()],
        }
    }

    /// The outputs of one electrode for its deformation, in the order of `outputs.axes`.
    pub fn electrode_outputs(&self, deformation_mm: Vector3) -> impl Iterator<Item = f64> {
        let vector = match self.outputs.quantity {
            Quantity::Deformation => deformation_mm,
            Quantity::Force => self.sensor.force_n(deformation_mm),
        };
        self.outputs.axes.iter().map(move |axis| vector[axis.index()])
    }
}

#[cfg(test)]
mod tests;
