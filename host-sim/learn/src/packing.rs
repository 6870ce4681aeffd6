//! Packing of trained models into blobs: the bytes that a device holds.

use std::path::Path;

use taxel_core::AlignedBytes;
use taxel_core::blob::{
    self, Columns, DecodeError, Floats, Front, Metadata, Model, ModelParts, NoiseKind,
};
use taxel_core::rbf::Network;
use taxel_core::reading_model::ReadingModel;
use taxel_core::track::Tracker;
use taxel_data::{Dataset, columns, input};

use crate::error::{Error, Result, not_packed};
use crate::infer;
use crate::train::{FittedFront, FittedNetwork, Trained};

/// Frames that are decoded at once to measure their errors.
const FRAMES_AT_ONCE: usize = 8192;

/// Largest blob in bytes that is read: 256 MB.
pub const MOST_BLOB_BYTES: u64 = 256_000_000;

/// Origin of a model's training data, for the blob's metadata.
#[derive(Debug, Clone, PartialEq)]
pub struct Origin {
    /// Name of the scene or data set.
    pub name: String,
    /// CRC-64/XZ of the scene's or data's file.
    pub digest: u64,
    /// Kind of noise that was added, and its level as a fraction.
    pub noise: (NoiseKind, f64),
    /// Seed of every random draw.
    pub seed: u64,
    /// Sensor thickness H in mm; `None` where it has no meaning.
    pub thickness_mm: Option<f64>,
    /// Full scale of each output, in its unit.
    pub full_scale: Vec<f64>,
    /// RMSE of the best linear decoder for each output, in its unit, on frames that it was not fitted to. Empty if it is
    /// not known.
    pub linear_rmse: Vec<f64>,
}

impl Origin {
    /// Origin of measured data, without noise: full scale is each output's range.
    pub fn of_data(name: &str, digest: u64, seed: u64, dataset: &Dataset) -> Self {
        let full_scale = dataset.outputs.ranges().into_iter().map(|[low, high]| high - low);
        Self {
            name: name.into(),
            digest,
            noise: (NoiseKind::None, 0.0),
            seed,
            thickness_mm: None,
            full_scale: full_scale.collect(),
            linear_rmse: vec![],
        }
    }
}

/// Packs the networks and the projection `trained` on `dataset` into a blob.
///
/// # Errors
/// [`Error`] for a model beyond what the format holds.
pub fn pack(trained: &Trained, dataset: &Dataset, origin: &Origin) -> Result<ModelBlob> {
    packed(trained, dataset, origin, training_rmse)
}

/// Packs a model as [`pack`] does, but its errors on the training frames, which take another decoding of them, are 0.
///
/// # Errors
/// As [`pack`].
pub fn pack_to_judge(trained: &Trained, dataset: &Dataset, origin: &Origin) -> Result<ModelBlob> {
    packed(trained, dataset, origin, |_, _, dataset| vec![0.0; dataset.outputs.names.len()])
}

fn packed(
    trained: &Trained,
    dataset: &Dataset,
    origin: &Origin,
    training_rmse: fn(&[Front<'_>], &[Network<'_>], &Dataset) -> Vec<f64>,
) -> Result<ModelBlob> {
    let views: Vec<Network<'_>> = trained.networks.iter().map(FittedNetwork::network).collect();
    let fronts: Vec<Front<'_>> = trained.fronts.iter().map(FittedFront::view).collect();
    let row_network: Vec<u8> = if fronts.is_empty() {
        (0..dataset.rows).map(|row| row as u8).collect()
    } else {
        vec![0; dataset.rows]
    };
    let lines = |names: &[String]| names.join("\n");
    let units = |names: &[String]| {
        names.iter().map(|name| columns::unit_of(name)).collect::<Vec<_>>().join("\n")
    };
    let (input_names, output_names) = (lines(&dataset.inputs.names), lines(&dataset.outputs.names));
    let output_units = units(&dataset.outputs.names);
    let input_units = if dataset.relative_inputs {
        "\n".repeat(dataset.inputs.names.len() - 1)
    } else {
        units(&dataset.inputs.names)
    };
    let [full_scale, linear_rmse] = [&origin.full_scale, &origin.linear_rmse].map(|it| floats(it));
    let training_rmse = floats(&training_rmse(&fronts, &views, dataset));
    let parts = ModelParts {
        fronts: &fronts,
        linear_rmse: Floats(&linear_rmse),
        reading_model: None,
        tracker: None,
        networks: &views,
        row_network: &row_network,
        metadata: Metadata {
            name: &origin.name,
            scene_digest: origin.digest,
            noise_kind: if origin.noise.1 == 0.0 { NoiseKind::None } else { origin.noise.0 },
            noise_level: origin.noise.1 as f32,
            seed: origin.seed,
            training_frames: u32::try_from(dataset.frames()).unwrap_or(u32::MAX),
            thickness_mm: origin.thickness_mm.map_or(0.0, |h| h as f32),
            relative_inputs: dataset.relative_inputs,
            input_names: Columns(&input_names),
            input_units: Columns(&input_units),
            output_names: Columns(&output_names),
            output_units: Columns(&output_units),
            training_rmse: Floats(&training_rmse),
            full_scale: Floats(&full_scale),
        },
    };
    Ok(ModelBlob { bytes: blob::encode_to_vec(&parts).map_err(not_packed)? })
}

/// Values as a blob holds them.
fn floats(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|value| (*value as f32).to_le_bytes()).collect()
}

/// RMSE of each output on the frames that it was trained on; NaN for an output without a value.
fn training_rmse(fronts: &[Front<'_>], networks: &[Network<'_>], dataset: &Dataset) -> Vec<f64> {
    let (inputs, outputs) = (&dataset.inputs, &dataset.outputs);
    let mut sums = vec![(0.0, 0.0); outputs.names.len()];
    let readings = inputs.values.chunks((FRAMES_AT_ONCE * inputs.names.len()).max(1));
    let truth = outputs.values.chunks((FRAMES_AT_ONCE * sums.len()).max(1));
    for (readings, truth) in readings.zip(truth) {
        let decoded = infer::decode(fronts, networks, readings);
        for (place, (truth, decoded)) in truth.iter().zip(decoded).enumerate() {
            let square = (truth - decoded).powi(2);
            if !square.is_nan() {
                let (sum, count) = &mut sums[place % outputs.names.len()];
                (*sum, *count) = (*sum + square, *count + 1.0);
            }
        }
    }
    sums.into_iter().map(|(sum, count)| (sum / f64::max(count, 1.0)).sqrt()).collect()
}

/// Blob of a model, checked from end to end.
#[derive(Debug)]
pub struct ModelBlob {
    bytes: AlignedBytes,
}

impl ModelBlob {
    /// Reads and checks the blob at `path`.
    ///
    /// # Errors
    /// [`Error`] for a file that cannot be read or is larger than [`MOST_BLOB_BYTES`], or a blob that is rejected.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = input::read(path, MOST_BLOB_BYTES)?;
        Self::of_bytes(&bytes).map_err(|cause| Error::unfit(format!("{}: {cause}", path.display())))
    }

    /// Checks and copies the `bytes` of a blob.
    ///
    /// # Errors
    /// [`DecodeError`] that says why the blob is rejected.
    pub fn of_bytes(bytes: &[u8]) -> std::result::Result<Self, DecodeError> {
        let bytes = AlignedBytes::copy_of(bytes);
        Model::decode(&bytes).map(drop)?;
        Ok(Self { bytes })
    }

    /// Bytes of the blob.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Blob of this model with the given reading model, or none, instead of its own.
    ///
    /// # Errors
    /// [`Error`] for a reading model of another model, or a blob that becomes too large.
    pub fn with_reading_model(&self, reading_model: Option<ReadingModel<'_>>) -> Result<Self> {
        let model = self.parse();
        let (fronts, networks): (Vec<_>, Vec<_>) =
            (model.fronts().collect(), model.networks().collect());
        rebuild(&model, &fronts, &networks, reading_model, model.tracker())
    }

    /// Blob of this model with the given tracker.
    ///
    /// # Errors
    /// [`Error`] for a tracker of another sensor, or a blob that becomes too large.
    pub fn with_tracker(&self, tracker: Tracker<'_>) -> Result<Self> {
        let model = self.parse();
        let (fronts, networks): (Vec<_>, Vec<_>) =
            (model.fronts().collect(), model.networks().collect());
        rebuild(&model, &fronts, &networks, model.reading_model(), Some(tracker))
    }

    /// Mean width σ of all Gaussians, on inputs scaled to [0, 1], to four digits.
    pub fn spread(&self) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for network in self.parse().networks() {
            for width in network.widths() {
                (sum, count) = (sum + f64::from(width), count + 1.0);
            }
        }
        (sum / count * 1e4).round() / 1e4
    }

    /// Parses the model, which checks every byte: [prepare](Self::prepare) it once if it is used often.
    ///
    /// # Panics
    /// Never: the bytes were checked when they were read and have not changed since.
    pub fn parse(&self) -> Model<'_> {
        Model::decode(self.bytes()).expect("checked when read")
    }
}

/// Blob of `model` with these `fronts`, `networks`, reading model and tracker instead of its own.
///
/// # Errors
/// [`Error`] for parts that do not belong together, or a blob that becomes too large.
pub(crate) fn rebuild(
    model: &Model<'_>,
    fronts: &[Front<'_>],
    networks: &[Network<'_>],
    reading_model: Option<ReadingModel<'_>>,
    tracker: Option<Tracker<'_>>,
) -> Result<ModelBlob> {
    let of_row = |row| model.network_of_row(row).map(|network| network as u8);
    let row_network: Vec<u8> = (0..model.shape().rows).filter_map(of_row).collect();
    let parts = ModelParts {
        fronts,
        linear_rmse: model.linear_rmse(),
        reading_model,
        tracker,
        networks,
        row_network: &row_network,
        metadata: *model.metadata(),
    };
    Ok(ModelBlob { bytes: blob::encode_to_vec(&parts).map_err(not_packed)? })
}
