//! The models that are measured: of the paper's shape, one network for all rows, drawn at random
//! from a fixed seed, so that they are the same everywhere.

use std::fs;
use std::path::{Path, PathBuf};

use model_core::blob::{
    Columns, Floats, Metadata, ModelParts, NoiseKind, encode, encoded_length_bound,
};
use model_core::rbf::Shape;
use model_core::rbf::direct::{Network, Parameters};

use crate::process::Outcome;

const ROWS: usize = 8;
const INPUTS: usize = 18;
const OUTPUTS: usize = 18;

/// K.
const CENTRES: [usize; 5] = [16, 32, 64, 128, 256];

/// σ of every centre, on scaled inputs.
const WIDTH: f32 = 0.7;

/// Readings run from here to here in ohm.
const READINGS_OHM: [f32; 2] = [50.0, 70.0];

/// Kinds of blob, each with what encodes a network so.
const KINDS: [(&str, Encode); 1] = [("f32-direct", encode_direct)];

type Encode = fn(&[Network<'_>]) -> Outcome<Vec<u8>>;

/// Writes a blob of every kind and size into `directory`.
pub fn write(directory: &Path) -> Outcome<Vec<PathBuf>> {
    let failed = |path: &Path, cause| format!("{}: {cause}", path.display());
    fs::create_dir_all(directory).map_err(|cause| failed(directory, cause))?;
    let mut paths = Vec::new();
    for (kind, encode) in KINDS {
        for centres in CENTRES {
            let path = directory.join(format!("{kind}-{centres}.bin"));
            let blob = Drawn::new(centres).encoded(encode)?;
            fs::write(&path, blob).map_err(|cause| failed(&path, cause))?;
            paths.push(path);
        }
    }
    Ok(paths)
}

/// Numbers without a pattern, the same everywhere: the upper half of a linear congruential
/// generator (Knuth's MMIX).
struct Numbers(u64);

impl Numbers {
    /// In [0, 1).
    fn uniform(&mut self) -> f32 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1 << 24) as f32
    }

    /// Of mean 0 and standard deviation 1, nearly: twelve uniform numbers added (Irwin and Hall).
    fn normal(&mut self) -> f32 {
        (0..12).map(|_| self.uniform()).sum::<f32>() - 6.0
    }

    fn normals(&mut self, count: usize, deviation: f32) -> Vec<f32> {
        (0..count).map(|_| deviation * self.normal()).collect()
    }
}

/// A network's parameters.
struct Drawn {
    shape: Shape,
    input_minimum: Vec<f32>,
    input_per_span: Vec<f32>,
    centres: Vec<f32>,
    decay: [f32; 1],
    output_weights: Vec<f32>,
    bias: Vec<f32>,
    affine: Vec<f32>,
}

impl Drawn {
    fn new(centres: usize) -> Self {
        let mut numbers = Numbers(centres as u64);
        let [lowest, highest] = READINGS_OHM;
        Self {
            shape: Shape { inputs: INPUTS, centres, outputs: OUTPUTS },
            input_minimum: vec![lowest; INPUTS],
            input_per_span: vec![1.0 / (highest - lowest); INPUTS],
            centres: (0..centres * INPUTS).map(|_| numbers.uniform()).collect(),
            decay: [1.0 / (2.0 * WIDTH * WIDTH)],
            output_weights: numbers.normals(centres * OUTPUTS, 1.0 / (centres as f32).sqrt()),
            bias: numbers.normals(OUTPUTS, 0.1),
            affine: Vec::new(),
        }
    }

    fn encoded(&self, encode: Encode) -> Outcome<Vec<u8>> {
        let parameters = Parameters {
            input_minimum: &self.input_minimum,
            input_per_span: &self.input_per_span,
            centres: &self.centres,
            decay: &self.decay,
            output_weights: &self.output_weights,
            bias: &self.bias,
            affine: &self.affine,
        };
        let network =
            Network::try_new(self.shape, parameters).map_err(|cause| cause.to_string())?;
        encode(&[network])
    }
}

fn encode_direct(networks: &[Network<'_>]) -> Outcome<Vec<u8>> {
    let (inputs, outputs) = (["x"; ROWS * INPUTS].join("\n"), ["y"; ROWS * OUTPUTS].join("\n"));
    let zeros = [0.0; ROWS * OUTPUTS];
    let parts = ModelParts {
        networks: &networks.iter().map(|network| (*network).into()).collect::<Vec<_>>(),
        row_network: &[0; ROWS],
        metadata: Metadata {
            name: "cycles",
            scene_digest: 0,
            noise_kind: NoiseKind::None,
            noise_level: 0.0,
            seed: 0,
            training_frames: 0,
            thickness_mm: 0.0,
            input_names: Columns(&inputs),
            input_units: Columns(&inputs),
            output_names: Columns(&outputs),
            output_units: Columns(&outputs),
            training_rmse: Floats::of(&zeros),
            full_scale: Floats::of(&zeros),
        },
    };
    // A blob must lie at a multiple of four.
    let mut room = vec![0; encoded_length_bound(&parts) + 3];
    let start = room.as_ptr().align_offset(4);
    let room = room.get_mut(start..).unwrap_or_default();
    encode(&parts, room).map(<[u8]>::to_vec).map_err(|cause| cause.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Figures are compared with those of other machines: the models must be the same there.
    #[test]
    fn the_models_are_the_same_everywhere() {
        let blob = Drawn::new(16).encoded(encode_direct).unwrap();
        let crc = blob.last_chunk().copied().map(u32::from_le_bytes);
        assert_eq!((blob.len(), crc), (6188, Some(0x3DD7_7D55)));
    }

    #[test]
    fn the_draws_are_spread_as_they_should_be() {
        let mut numbers = Numbers(1);
        let drawn = numbers.normals(10_000, 1.0);
        let mean = drawn.iter().sum::<f32>() / drawn.len() as f32;
        let variance = drawn.iter().map(|x| (x - mean).powi(2)).sum::<f32>() / drawn.len() as f32;
        assert!(mean.abs() < 0.05 && (variance - 1.0).abs() < 0.05, "{mean}, {variance}");
    }
}
