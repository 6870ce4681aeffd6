//! Trained models: to a blob and back.

use std::borrow::Cow;
use std::path::Path;

use model_core::blob::{
    self, Columns, Floats, Metadata, Model, ModelParts, NoiseKind as BlobNoiseKind,
};
use model_core::rbf::Network;
use model_core::scale::CLAMP;

use crate::columns;
use crate::dataset::{Dataset, Table};
use crate::error::{Error, Result};
use crate::infer::{Kernel, infer, infer_rows, is_missing};
use crate::progress::Progress;
use crate::random::Stream;
use crate::scene::{NoiseKind, Scene};
use crate::synth;
use crate::train::{self, FittedNetwork, Options, Trained};

/// Where a model's training data came from.
#[derive(Debug, Clone, PartialEq)]
pub struct Origin {
    /// Name of the scene or data set.
    pub name: String,
    /// Digest of the scene's or data's file.
    pub digest: u64,
    /// How noise was added, and its level.
    pub noise: Option<(NoiseKind, f64)>,
    /// Seed of every draw.
    pub seed: u64,
    /// Sensor thickness H; `None` where it has no meaning.
    pub thickness_mm: Option<f64>,
    /// Full scale of each output, in its unit.
    pub full_scale: Vec<f64>,
}

impl Origin {
    /// The origin of a scene's frames.
    #[must_use]
    pub fn of_scene(scene: &Scene) -> Self {
        let electrodes = scene.read_rows.len() * scene.sensor.electrodes_per_row_wire;
        let of_one = scene.outputs.axes.iter().map(|axis| scene.full_scale(*axis));
        let full_scale = of_one.collect::<Vec<_>>().repeat(electrodes);
        Self {
            name: scene.name.clone(),
            digest: scene.digest,
            noise: Some((scene.noise.kind, scene.noise.level)),
            seed: scene.seed,
            thickness_mm: Some(scene.sensor.size_mm[2]),
            full_scale,
        }
    }

    /// The origin of measured data: full scale is each output's range.
    #[must_use]
    pub fn of_data(name: &str, digest: u64, seed: u64, dataset: &Dataset) -> Self {
        let full_scale = dataset.outputs.ranges().into_iter().map(|[low, high]| high - low);
        Self {
            name: name.into(),
            digest,
            noise: None,
            seed,
            thickness_mm: None,
            full_scale: full_scale.collect(),
        }
    }
}

/// How `scene` wants its model trained.
#[must_use]
pub fn options_of(scene: &Scene) -> Options {
    let t = &scene.training;
    let options = Options::new(t.centres, t.spread, t.affine_tail, scene.seed);
    Options { format: t.format, whole_array: t.whole_array, ..options }
}

/// Trains the model that `scene` describes, as the command `train` does.
///
/// # Errors
/// [`Error::Usage`] for training options that cannot be, [`Error::Failed`] as [`encode`].
pub fn train_scene(scene: &Scene, progress: &Progress) -> Result<LoadedModel> {
    let frames = synth::synthesise(scene, Stream::Training, scene.training.frames);
    let options = options_of(scene);
    let trained = train::train(&frames, &options, progress)?;
    let blob = encode(&trained, &frames, &Origin::of_scene(scene))?;
    LoadedModel::from_bytes(Path::new("the model just trained"), &blob)
}

/// Writes what was `trained` on `dataset` as a blob.
///
/// # Errors
/// [`Error::Failed`] for a model beyond what the format holds.
pub fn encode(trained: &Trained, dataset: &Dataset, origin: &Origin) -> Result<Vec<u8>> {
    let views: Vec<Network<'_>> = trained.networks.iter().map(FittedNetwork::network).collect();
    let projection = trained.projection.as_ref().map(|block| train::view(block, dataset));
    let row_network: Vec<u8> = match projection {
        Some(_) => vec![0; dataset.rows],
        None => (0..dataset.rows).map(|row| row as u8).collect(),
    };
    let lines = |names: &[String]| names.join("\n");
    let units = |names: &[String]| {
        names.iter().map(|name| columns::unit_of(name)).collect::<Vec<_>>().join("\n")
    };
    let floats = |values: &[f64]| -> Vec<u8> {
        values.iter().flat_map(|value| (*value as f32).to_le_bytes()).collect()
    };
    let (input_names, output_names) = (lines(&dataset.inputs.names), lines(&dataset.outputs.names));
    let (input_units, output_units) = (units(&dataset.inputs.names), units(&dataset.outputs.names));
    let training_rmse = floats(&match projection {
        Some(it) => training_rmse(&views, &train::projection::apply(it, dataset)),
        None => training_rmse(&views, dataset),
    });
    let full_scale = floats(&origin.full_scale);
    let parts = ModelParts {
        projection,
        networks: &views,
        row_network: &row_network,
        metadata: Metadata {
            name: &origin.name,
            scene_digest: origin.digest,
            noise_kind: match origin.noise {
                Some((_, 0.0)) | None => BlobNoiseKind::None,
                Some((NoiseKind::Relative, _)) => BlobNoiseKind::Relative,
                Some((NoiseKind::Span, _)) => BlobNoiseKind::Span,
            },
            noise_level: origin.noise.map_or(0.0, |(_, level)| level as f32),
            seed: origin.seed,
            training_frames: u32::try_from(dataset.frames()).unwrap_or(u32::MAX),
            thickness_mm: origin.thickness_mm.map_or(0.0, |h| h as f32),
            input_names: Columns(&input_names),
            input_units: Columns(&input_units),
            output_names: Columns(&output_names),
            output_units: Columns(&output_units),
            training_rmse: Floats(&training_rmse),
            full_scale: Floats(&full_scale),
        },
    };
    let mut buffer = AlignedBytes::zeroed(blob::encoded_length_bound(&parts));
    let encoded = blob::encode(&parts, buffer.as_mut_slice())
        .map_err(|cause| Error::Failed(format!("the model cannot be written: {cause}")))?;
    Ok(encoded.to_vec())
}

fn training_rmse(networks: &[Network<'_>], dataset: &Dataset) -> Vec<f64> {
    let mut rmse = Vec::new();
    for (row, network) in networks.iter().enumerate() {
        let block = dataset.block(row);
        let predicted = infer(network, Kernel::default(), &block.inputs);
        let squares = block.outputs.squared_errors(&predicted);
        rmse.extend(squares.iter().map(|s| (s / dataset.frames() as f64).sqrt()));
    }
    rmse
}

/// A blob read from a file, checked.
#[derive(Debug)]
pub struct LoadedModel {
    bytes: AlignedBytes,
}

impl LoadedModel {
    /// Reads and checks the blob at `path`.
    ///
    /// # Errors
    /// [`Error::Read`] or [`Error::Blob`].
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).map_err(|cause| Error::read(path, cause))?;
        Self::from_bytes(path, &bytes)
    }

    /// Checks a blob; `path` names it in messages.
    ///
    /// # Errors
    /// [`Error::Blob`].
    pub fn from_bytes(path: &Path, bytes: &[u8]) -> Result<Self> {
        let bytes = AlignedBytes::copy_of(bytes);
        match Model::decode(bytes.as_slice()) {
            Ok(_) => Ok(Self { bytes }),
            Err(cause) => Err(Error::Blob { path: path.into(), cause }),
        }
    }

    /// The model.
    ///
    /// # Panics
    /// Never: the bytes were checked when they were read and have not changed since.
    #[must_use]
    pub fn model(&self) -> Model<'_> {
        Model::decode(self.bytes.as_slice()).expect("checked when read")
    }

    /// The blob's bytes.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        self.bytes.as_slice()
    }

    /// The network that serves each row-wire, or the one for all behind a projection.
    pub(crate) fn networks_in_turn(&self) -> Vec<Network<'_>> {
        let model = self.model();
        let networks: Vec<Network<'_>> = model.networks().collect();
        if model.projection().is_some() {
            return networks;
        }
        let rows = 0..model.shape().rows;
        rows.map(|row| networks[model.network_of_row(row).expect("a row of the model")]).collect()
    }

    /// What these networks take in, in turn: the readings, or features of them.
    fn inputs_of_networks<'t>(&self, readings: &'t Table) -> Cow<'t, Table> {
        let model = self.model();
        match model.projection() {
            Some(projection) => {
                let features = model.shape().inputs;
                Cow::Owned(train::projection::features(projection, features, readings))
            }
            None => Cow::Borrowed(readings),
        }
    }

    /// Share of `readings`, or of their features behind a projection, that inference clamps: outside the
    /// training range by more than an eighth of it.
    ///
    /// # Panics
    /// If `readings` has other columns than the model's inputs.
    #[must_use]
    pub fn share_out_of_range(&self, readings: &Table) -> f64 {
        let networks = self.networks_in_turn();
        let inputs = self.model().shape().inputs;
        let readings = self.inputs_of_networks(readings);
        let range = |network: &Network<'_>, input| network.training_range(input).map(f64::from);
        let ranges: Vec<[f64; 2]> = networks
            .iter()
            .flat_map(|network| (0..inputs).map(move |input| range(network, input)))
            .collect();
        let (mut clamped, mut present) = (0_usize, 0_usize);
        for line in readings.lines() {
            for (reading, [lowest, highest]) in line.iter().zip(&ranges) {
                if !is_missing(*reading) {
                    let place = (reading - lowest) / (highest - lowest);
                    let inside = (f64::from(CLAMP[0])..=f64::from(CLAMP[1])).contains(&place);
                    present += 1;
                    clamped += usize::from(highest > lowest && !inside);
                }
            }
        }
        clamped as f64 / present.max(1) as f64
    }

    /// Decodes a table of readings whose columns are the model's inputs; NaN readings make the
    /// outputs of their row-wire NaN, behind a projection those of all.
    ///
    /// # Panics
    /// If `readings` has other columns than the model's inputs.
    #[must_use]
    pub fn decode(&self, kernel: Kernel, readings: &Table) -> Table {
        let model = self.model();
        let names = model.metadata().output_names.iter().map(String::from).collect::<Vec<_>>();
        let inputs = self.inputs_of_networks(readings);
        let values = infer_rows(&self.networks_in_turn(), kernel, &inputs);
        Table { names, values }
    }
}

/// Bytes that start at a multiple of four, as a blob must.
#[derive(Debug)]
struct AlignedBytes {
    words: Vec<u32>,
    length: usize,
}

impl AlignedBytes {
    fn zeroed(length: usize) -> Self {
        Self { words: vec![0; length.div_ceil(4)], length }
    }

    fn copy_of(bytes: &[u8]) -> Self {
        let mut this = Self::zeroed(bytes.len());
        this.as_mut_slice().copy_from_slice(bytes);
        this
    }

    fn as_slice(&self) -> &[u8] {
        &bytemuck::cast_slice(&self.words)[..self.length]
    }

    fn as_mut_slice(&mut self) -> &mut [u8] {
        &mut bytemuck::cast_slice_mut(&mut self.words)[..self.length]
    }
}
