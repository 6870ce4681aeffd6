//! The numbers that a network's inputs are made of, and the way back to layers.
//!
//! Without a projection these are a row's readings, scaled. With one they are the features that it starts with,
//! and then all readings: inputs are a mix of both. Features then change as a whole as easily as single parts do.

use taxel_core::projection::Projection;
use taxel_core::rbf::Format;
use taxel_data::Dataset;

use super::movable::Piece;
use super::products::SIDE;
use super::targets::Targets;
use super::{turn, width};
use crate::error::Result;
use crate::parallel;
use crate::train::layers::Layers;
use crate::train::touch::GroupFrames;
use crate::train::{HiddenLayer, InputScale, projection};

/// Size of a reading as a source: so many times a typical part of the projection, for a reading of one standard
/// deviation. The larger, the faster single parts move.
const READING_SCALE: f64 = 4.0;

/// Numbers that the networks of a data set start from.
pub(super) struct Sources {
    inputs: Inputs,
    targets: Targets,
    /// Columns of each network's tasks. Networks are one a row, or one in all.
    tasks: Vec<Vec<Vec<usize>>>,
}

/// Where the descent of a network starts.
pub(super) struct Start {
    /// Gaussians among the inputs.
    pub(super) layer: HiddenLayer,
    /// What each source adds to each input, `sources × inputs`; empty where sources are the inputs.
    pub(super) mix: Vec<f64>,
    /// Ranges that inputs are scaled by.
    pub(super) ranges: Vec<[f64; 2]>,
    /// Outputs of each task.
    pub(super) tasks: Vec<Vec<usize>>,
}

enum Inputs {
    /// Readings, by the scale of each row.
    Rows(Vec<InputScale>),
    /// Features and readings of the whole array.
    Projected(Projected),
}

/// What the refinement of a projection starts from.
struct Projected {
    /// f₀ of every feature, then each reading's part in every feature.
    parameters: Vec<f32>,
    features: usize,
    /// Low end of each feature's range, and the common span, by which centres are scaled.
    lows: Vec<f64>,
    span: f64,
    /// Mean of every reading, and its scale as a source.
    readings: Vec<(f64, f64)>,
    /// Rotation of the features that the mix starts with, `features × features`.
    turn: Vec<f64>,
}

impl Sources {
    pub(super) fn new(dataset: &Dataset, layers: &Layers) -> Self {
        let inputs = if let Some(parameters) = &layers.projection {
            Inputs::Projected(Projected::new(dataset, parameters, &layers.seen.table))
        } else {
            let scale = |row| InputScale::new(&dataset.row_table(row));
            Inputs::Rows((0..dataset.rows).map(scale).collect())
        };
        let networks = layers.hidden.len();
        let width = dataset.outputs.names.len() / networks;
        let tasks = |network| dataset.outputs.columns(network * width, width).missing_together();
        let tasks = (0..networks).map(tasks).collect();
        Self { inputs, targets: Targets::new(dataset, networks), tasks }
    }

    /// Start of the descent of network number `network` with this `layer`.
    pub(super) fn start(&self, (network, layer): (usize, &HiddenLayer)) -> Start {
        let (layer, mix) = match &self.inputs {
            Inputs::Projected(projected) => (projected.among_features(layer), projected.start()),
            Inputs::Rows(_) => (layer.clone(), vec![]),
        };
        Start { layer, mix, ranges: self.ranges(network), tasks: self.tasks[network].clone() }
    }

    /// Ranges of the inputs that layers are scaled by.
    ///
    /// The format puts the centres of an input that never changes, which are 0, into its middle.
    fn ranges(&self, network: usize) -> Vec<[f64; 2]> {
        let range = |still: bool| if still { [-0.5, 0.5] } else { [0.0, 1.0] };
        match &self.inputs {
            Inputs::Rows(scales) => scales[network].never_changes().map(range).collect(),
            Inputs::Projected(projected) => vec![[0.0, 1.0]; projected.features],
        }
    }

    /// Layers that the descents for `frames` have come to: the hidden layer among mixed inputs, and the mix, of each
    /// network. They are rounded and widened as the `format` asks for.
    ///
    /// # Errors
    /// [`Error`](crate::Error) for a projection beyond f32.
    pub(super) fn layers(
        &self,
        frames: &GroupFrames,
        found: &[(HiddenLayer, &[f64])],
        format: Format,
    ) -> Result<Layers> {
        let mut layers = match (&self.inputs, found) {
            (Inputs::Projected(projected), [(layer, mix)]) => {
                projected.layers(frames, mix, layer)?
            }
            _ => Layers {
                projection: None,
                seen: frames.seen(None),
                hidden: found.iter().map(|(layer, _)| layer.clone()).collect(),
            },
        };
        for (network, layer) in layers.hidden.iter_mut().enumerate() {
            // As the blob holds them.
            layer.centres.iter_mut().for_each(|c| *c = f64::from(*c as f32));
            if format == Format::Fixed16 {
                let least = width::least(&layer.centres, &self.ranges(network));
                layer.spread = layer.spread.max(least);
            }
        }
        Ok(layers)
    }

    /// Samples of network number `network`, side by side. Those of the same tasks stand together, for what most pieces
    /// have then serves all of their tasks.
    pub(super) fn pieces(&self, frames: &Dataset, network: usize) -> Vec<Piece> {
        let targets = self.targets.of_network(&frames.outputs, network);
        let missing = |line: &usize| -> Vec<bool> {
            targets.line(*line).iter().map(|target| target.is_nan()).collect()
        };
        let mut lines: Vec<usize> =
            (0..targets.len()).filter(|line| missing(line).contains(&false)).collect();
        lines.sort_by_cached_key(missing);
        let outputs: Vec<usize> = (0..targets.names.len()).collect();
        let width = frames.inputs.names.len() / self.tasks.len();
        let readings: Vec<usize> = (network * width..(network + 1) * width).collect();
        let of_lines = |index| {
            let lines = parallel::piece(&lines, SIDE, index);
            let readings = frames.inputs.part(lines, &readings).values;
            let inputs = match &self.inputs {
                Inputs::Rows(scales) => scales[network].apply(&readings),
                Inputs::Projected(projected) => {
                    projected.sources(projection::view(&projected.parameters, width), &readings)
                }
            };
            let targets = targets.part(lines, &outputs).values;
            let weight = |line: &usize| frames.weights.as_ref().map_or(1.0, |it| it[*line]);
            let weights: Vec<f64> = lines.iter().map(weight).collect();
            let width = inputs.len() / lines.len();
            Piece::all((&inputs, width), (&targets, outputs.len()), &weights)
        };
        let pieces = parallel::map(lines.len().div_ceil(SIDE), &of_lines);
        pieces.into_iter().flatten().collect()
    }
}

impl Projected {
    fn new(dataset: &Dataset, parameters: &[f32], seen: &Dataset) -> Self {
        let features = seen.inputs.names.len();
        let (lows, span) = scale_of(seen);
        let parts = &parameters[features..];
        let (means, deviations) = (dataset.inputs.means(), dataset.inputs.deviations());
        let square = |part: &f32, deviation: &f64| (f64::from(*part) * deviation / span).powi(2);
        let lines = parts.chunks_exact(features).zip(&deviations);
        let squares: f64 =
            lines.flat_map(|(line, d)| line.iter().map(move |part| square(part, d))).sum();
        let typical = READING_SCALE * (squares / parts.len() as f64).sqrt();
        let scale = |deviation: f64| if deviation > 0.0 { typical / deviation } else { 0.0 };
        let readings = means.into_iter().zip(deviations).map(|(mean, d)| (mean, scale(d)));
        Self {
            parameters: parameters.to_vec(),
            features,
            lows,
            span,
            readings: readings.collect(),
            turn: turn::evening(&seen.inputs.values, features),
        }
    }

    /// Mix that a descent starts with, `sources × features`: the features rotated, and nothing of single readings.
    fn start(&self) -> Vec<f64> {
        let mut mix = self.turn.clone();
        mix.resize((self.features + self.readings.len()) * self.features, 0.0);
        mix
    }

    /// Centres and widths of `layer` among the features of the mix at the start.
    fn among_features(&self, layer: &HiddenLayer) -> HiddenLayer {
        let scaled = layer.centres.chunks_exact(self.features);
        let centres = scaled.flat_map(|centre| {
            let feature = |(c, low): (&f64, &f64)| c + low / self.span;
            centre.iter().zip(&self.lows).map(feature)
        });
        let centres: Vec<f64> = centres.collect();
        HiddenLayer { centres: turn::turned(&centres, &self.turn, self.features), ..layer.clone() }
    }

    /// Sources of the frames with these `readings`, line after line.
    fn sources(&self, view: Projection<'_>, readings: &[f64]) -> Vec<f64> {
        let count = self.readings.len();
        let features = projection::features(view, readings);
        let mut sources = Vec::with_capacity(features.len() + readings.len());
        let lines = features.chunks_exact(self.features).zip(readings.chunks_exact(count));
        for (features, readings) in lines {
            sources.extend(features.iter().map(|f| f / self.span));
            let readings = readings.iter().zip(&self.readings);
            sources.extend(readings.map(|(r, (mean, scale))| (r - mean) * scale));
        }
        sources
    }

    /// Projection and hidden layer that a descent has come to, with its `mix` and with a `layer` among the
    /// mixed features.
    ///
    /// # Errors
    /// [`Error`](crate::Error) for a projection beyond f32.
    fn layers(&self, frames: &GroupFrames, mix: &[f64], layer: &HiddenLayer) -> Result<Layers> {
        let n = self.features;
        let parts = self.parameters[n..].chunks_exact(n).zip(&self.readings);
        let mixed =
            parts.zip(mix[n * n..].chunks_exact(n)).flat_map(|((parts, (_, scale)), own)| {
                let part = |j: usize| {
                    let of_features: f64 =
                        (0..n).map(|i| f64::from(parts[i]) * mix[i * n + j]).sum();
                    of_features / self.span + scale * own[j]
                };
                (0..n).map(part).collect::<Vec<_>>()
            });
        let parts: Vec<f64> = mixed.collect();
        let means: Vec<f64> = self.readings.iter().map(|(mean, _)| *mean).collect();
        let parameters = projection::about_means(&parts, &means)?;
        let turn = turn::evening(&frames.seen(Some(&parameters)).table.inputs.values, n);
        let parameters = projection::about_means(&turn::turned(&parts, &turn, n), &means)?;
        let seen = frames.seen(Some(&parameters));
        let (lows, span) = scale_of(&seen.table);
        let centres = turn::turned(&layer.centres, &turn, n);
        let scaled = centres
            .chunks_exact(n)
            .flat_map(|centre| centre.iter().zip(&lows).map(|(c, low)| (c - low) / span));
        let (centres, spread) = (scaled.collect(), layer.spread / span);
        let layer = HiddenLayer { centres, spread };
        Ok(Layers { projection: Some(parameters), seen, hidden: vec![layer] })
    }
}

/// Low end of every feature's range, and their common span.
fn scale_of(seen: &Dataset) -> (Vec<f64>, f64) {
    let ranges = seen.input_ranges();
    let span = ranges.first().map(|[low, high]| high - low);
    let span = span.filter(|span| *span > 0.0).unwrap_or(1.0);
    (ranges.into_iter().map(|[low, _]| low).collect(), span)
}
