//! Direction of a scene's networks, and what follows from it.

use serde::Deserialize;
use taxel_data::{Stream, require};
use taxel_simulate::outputs::Outputs;
use taxel_simulate::{Synthesis, World};

use super::{Check, Experiment};
use crate::error::{Error, Result};

/// Direction of a network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Direction {
    /// From readings to deformations: it decodes.
    #[default]
    Inverse,
    /// From the deformation of a row to its noisy readings, as at the end of the paper's §3.
    Forward,
}

impl Experiment {
    /// Whether its models predict readings from deformations.
    pub fn is_forward(&self) -> bool {
        self.training.direction == Direction::Forward
    }

    /// Names of the model's inputs.
    pub fn input_names(&self) -> Vec<String> {
        if self.is_forward() { self.world.output_names() } else { self.world.reading_names() }
    }

    /// Names of the model's outputs.
    pub fn output_names(&self) -> Vec<String> {
        if self.is_forward() { self.world.reading_names() } else { self.world.output_names() }
    }

    /// Full scale of each of the model's outputs: of a reading, its span over the scene.
    pub(super) fn full_scales(&self) -> Vec<f64> {
        const SPAN_FRAMES: usize = 4096;
        if !self.is_forward() {
            return self.world.full_scales();
        }
        let readings = Synthesis::new(&self.world).ideal().frames(Stream::Span, SPAN_FRAMES).inputs;
        readings.ranges().into_iter().map(|[low, high]| high - low).collect()
    }

    /// Refuses a scene whose models predict readings, for a `command` that is about decoding.
    ///
    /// # Errors
    /// [`Error::Data`] for a scene with `direction = "forward"`.
    pub fn require_inverse(&self, command: &str) -> Result<()> {
        let rule =
            || format!("{command} is about models that decode readings: leave the field out");
        require(!self.is_forward(), "training.direction", "forward", rule)
            .map_err(|cause| Error::of_scene(&self.name, cause))
    }

    /// Checks what models that predict readings ask of the scene, whatever options have changed in it.
    pub fn check_direction(&self) -> Check {
        if !self.is_forward() {
            return Ok(());
        }
        let all = self.world.outputs == Outputs::all_deformations();
        require(all, "training.direction", "forward", || {
            "a row's readings follow from all its deformations: ask for outputs.quantity = \"deformation\" and \
             outputs.axes = [\"x\", \"y\", \"z\"]"
                .into()
        })?;
        require(!self.training.relative_inputs, "training.relative_inputs", true, || {
            "inputs are deformations with direction = \"forward\": leave one of the two out".into()
        })?;
        require(self.table1.is_none(), "table1", "[table1]", || {
            "the table is for models that decode; leave it out with direction = \"forward\"".into()
        })
    }
}

/// Root mean square in Ω of the noise on the readings of so many test `frames`.
pub(super) fn noise_ohm(world: &World, frames: usize) -> f64 {
    let of = |synthesis: Synthesis<'_>| synthesis.frames(Stream::Test, frames).inputs;
    let (noisy, ideal) = (of(Synthesis::new(world)), of(Synthesis::new(world).ideal()));
    let squares: f64 = noisy.squared_errors(&ideal.values).iter().sum();
    (squares / noisy.values.len() as f64).sqrt()
}
