//! Models laid out once for decoding frames and tables of any shape, bit for bit as a device does.

use std::borrow::Cow;
use std::sync::Arc;

use taxel_core::blob::{Front, Model};
use taxel_core::rbf::Network;
use taxel_core::reading_model::ReadingModel;
use taxel_core::scale::CLAMP;
use taxel_core::{Decoder, Frame};
use taxel_data::Table;

use crate::decoder::{Estimates, FrameDecoder, Frames};
use crate::infer::{assess_lines, decode, given, is_missing};
use crate::packing::ModelBlob;
use crate::parallel;
use crate::relative::{ratios, reciprocals};

/// Most rows of a model.
pub(crate) const MOST_ROWS: usize = u8::MAX as usize;
/// Frames below which each is decoded by the device's own code: those side by side cost as much for one as for all. In
/// fixed16 that is what five single frames cost.
const FEW_LINES: usize = 5;
/// Frames that a thread fills at a time.
const FRAMES_AT_ONCE: usize = 64;

/// Model that was parsed and laid out, ready to decode. Clones share what was laid out.
///
/// A model whose inputs are relative (R/R₀) takes readings once it has a [baseline](Self::with_baseline). Before,
/// every reading counts as missing.
#[derive(Debug, Clone)]
pub struct PreparedModel<'b> {
    model: Model<'b>,
    /// Network of each row-wire, or those that see whole frames.
    networks: Arc<[Network<'b>]>,
    /// What stands before each network that sees whole frames.
    fronts: Arc<[Front<'b>]>,
    output_names: Vec<String>,
    /// One over the baseline of each reading; `None` for a model that takes what it is given.
    reciprocals: Option<Vec<f32>>,
}

impl ModelBlob {
    /// Prepares the model for decoding. A model with relative inputs then needs a
    /// [baseline](PreparedModel::with_baseline).
    ///
    /// # Panics
    /// Never: every row of a model that was checked has a network.
    pub fn prepare(&self) -> PreparedModel<'_> {
        let model = self.parse();
        let networks: Vec<Network<'_>> = model.networks().collect();
        let of_row = |row| networks[model.network_of_row(row).expect("a row of the model")];
        let in_turn: Vec<Network<'_>> = if model.whole_frames() {
            networks.clone()
        } else {
            (0..model.shape().rows).map(of_row).collect()
        };
        let output_names = model.metadata().output_names.iter().map(String::from).collect();
        let readings = model.shape().rows * model.shape().inputs;
        PreparedModel {
            networks: in_turn.into(),
            fronts: model.fronts().collect(),
            output_names,
            reciprocals: model.metadata().relative_inputs.then(|| vec![f32::NAN; readings]),
            model,
        }
    }
}

impl<'b> PreparedModel<'b> {
    /// Parsed model: its shape, networks and metadata.
    pub fn model(&self) -> &Model<'b> {
        &self.model
    }

    /// Model that decodes readings relative to `baseline`: the mean of each reading of the untouched sensor, in the
    /// readings' units. It changes nothing in a model that takes readings as they are.
    ///
    /// A channel whose baseline is missing (NaN), zero, negative or infinite is missing in every frame.
    ///
    /// # Panics
    /// If the baseline does not have one value for each of the model's readings.
    #[must_use]
    pub fn with_baseline(mut self, baseline: &[f64]) -> Self {
        assert_eq!(baseline.len(), self.inputs(), "the model's readings");
        if self.model.metadata().relative_inputs {
            self.reciprocals = Some(reciprocals(baseline));
        }
        self
    }

    /// Model that is given its inputs instead of readings: those of a model with relative inputs are then
    /// [ratios](crate::relative::inputs). It changes nothing in any other model.
    #[must_use]
    pub fn of_inputs(mut self) -> Self {
        self.reciprocals = None;
        self
    }

    /// Inputs of the model for `readings` (`frames × inputs`): the readings, or their ratios to the baseline.
    pub fn model_inputs<'r>(&self, readings: &'r [f64]) -> Cow<'r, [f64]> {
        match &self.reciprocals {
            Some(reciprocals) => {
                let frames = readings.chunks_exact(reciprocals.len().max(1));
                Cow::Owned(frames.flat_map(|frame| ratios(frame, reciprocals)).collect())
            }
            None => Cow::Borrowed(readings),
        }
    }

    /// Decodes a table of readings (`frames × inputs`, in their units) to one of outputs (`frames
    /// × outputs`).
    ///
    /// A missing reading makes the outputs of its row-wire NaN; behind a projection, all outputs of the
    /// frame.
    ///
    /// # Panics
    /// If the number of columns differs from the model's number of readings.
    pub fn decode_table(&self, readings: &Table) -> Table {
        assert_eq!(readings.names.len(), self.inputs(), "the model's inputs");
        Table {
            names: self.output_names.clone(),
            values: self.decode_lines(&readings.values).into(),
        }
    }

    /// Decodes `readings` (`frames × inputs`) to outputs (`frames × outputs`), line after line.
    ///
    /// Outputs that are places are NaN in frames without a touch, as outputs of a frame with a missing reading are.
    pub fn decode_lines(&self, readings: &[f64]) -> Vec<f64> {
        let inputs = self.model_inputs(readings);
        if inputs.len() < FEW_LINES * self.inputs()
            && let Ok(decoder) = Decoder::<MOST_ROWS>::new(self.model)
        {
            let inputs: Vec<f32> = inputs.iter().map(|input| *input as f32).collect();
            let reciprocals = &vec![1.0; self.inputs()]; // of inputs that are relative already
            let frames = inputs.chunks_exact(reciprocals.len());
            let frames = frames.map(|readings_ohm| Frame { readings_ohm, reciprocals });
            let outputs = |frame| decoder.decode(frame).map_or(vec![], |decoded| decoded.outputs);
            return frames.flat_map(outputs).map(f64::from).collect();
        }
        decode(&self.fronts, &self.networks, &inputs)
    }

    /// Inputs of each network in turn, for `readings` (`frames × inputs`): numbers of a whole table a network that sees
    /// whole frames, else of all networks in one.
    pub(crate) fn inputs_of_networks(&self, readings: &[f64]) -> Vec<Vec<f64>> {
        let inputs = self.model_inputs(readings);
        if self.fronts.is_empty() {
            return vec![inputs.into_owned()];
        }
        let of_front = |front: &Front<'_>| {
            let (given, strengths) = given(front, &inputs);
            let mut given = given.into_owned();
            // A place without a touch is not decoded.
            if let (Some(touch), false) = (front.of_places(), strengths.is_empty()) {
                let width = given.len() / strengths.len();
                let least = touch.strengths().least;
                let lines = given.chunks_exact_mut(width).zip(&strengths);
                lines.filter(|(_, s)| **s < least).for_each(|(line, _)| line.fill(f64::NAN));
            }
            given
        };
        self.fronts.iter().map(of_front).collect()
    }

    /// Standard deviations of the outputs for `readings` (`frames × inputs`), `frames × outputs` in their units, and the
    /// novelty of each frame in nats, above 0 for a novel one; `None` if the model tells neither.
    ///
    /// A missing reading makes all of its frame's NaN.
    pub fn assess(&self, readings: &[f64]) -> Option<(Vec<f64>, Vec<f64>)> {
        let model = self.model.reading_model().filter(ReadingModel::assesses)?;
        let (deviations, novelty) = assess_lines(model, &self.model_inputs(readings));
        Some((deviations.into_iter().map(f64::from).collect(), novelty))
    }

    /// Readings (`frames × inputs`) with missing ones filled as a device fills them, and the number of readings filled in
    /// each frame; `None` if the model has no [reading model](taxel_core::reading_model).
    ///
    /// A model with relative inputs takes `baselines`: one line for all frames, or a line for each; without them, its own.
    pub fn filled(
        &self,
        readings: &[f64],
        baselines: Option<&Table>,
    ) -> Option<(Vec<f64>, Vec<usize>)> {
        let model = self.model.reading_model()?;
        let size = FRAMES_AT_ONCE * self.inputs();
        let of_piece = |piece: usize| {
            let mut values = parallel::piece(readings, size, piece).to_vec();
            let mut scratch = vec![0.0; model.sizes().scratch_floats()];
            let filled = |(frame, values): (usize, &mut [f64])| {
                if !values.iter().any(|reading| is_missing(*reading)) {
                    return 0;
                }
                let line = (piece * FRAMES_AT_ONCE + frame) * values.len();
                let of_frame = baselines.map(|all| {
                    let all = &all.values;
                    reciprocals(all.get(line..line + values.len()).unwrap_or(all))
                });
                let own = self.reciprocals.as_ref().map(|own| of_frame.as_ref().unwrap_or(own));
                let mut ohm: Vec<f32> = values.iter().map(|reading| *reading as f32).collect();
                let count = model.fill(&mut ohm, own.map(|all| &all[..]), &mut scratch);
                let missing = values.iter_mut().zip(ohm).filter(|(it, _)| is_missing(**it));
                missing.for_each(|(reading, ohm)| *reading = f64::from(ohm));
                count
            };
            let frames = values.chunks_exact_mut(self.inputs()).enumerate();
            let counts: Vec<usize> = frames.map(filled).collect();
            (values, counts)
        };
        let pieces = parallel::map(readings.len().div_ceil(size), &of_piece);
        let (values, counts): (Vec<_>, Vec<_>) = pieces.into_iter().unzip();
        Some((values.concat(), counts.concat()))
    }

    /// Whether decoding clamps an input, in each frame of `readings` (`frames × inputs`). Rows that cannot be decoded do
    /// not count.
    ///
    /// # Panics
    /// If `readings` are not whole frames of the model.
    pub fn clamps(&self, readings: &[f64]) -> Vec<bool> {
        let clamps = |network: &Network<'_>, row: &[f64]| {
            let row: Vec<f32> = row.iter().map(|input| *input as f32).collect();
            let decoded = row.iter().all(|input| input.is_finite());
            decoded && network.clamps(&row, &mut vec![0.0; row.len()]) == Ok(true)
        };
        let mut any = vec![false; readings.len() / self.inputs()];
        for (networks, inputs) in self.tables(readings) {
            let width = networks[0].shape().inputs;
            let of_frames = parallel::pieces(&inputs, width * networks.len(), &|frame| {
                networks.iter().zip(frame.chunks_exact(width)).any(|(it, row)| clamps(it, row))
            });
            any.iter_mut().zip(of_frames).for_each(|(any, clamped)| *any |= clamped);
        }
        any
    }

    /// Share of the inputs for `readings`, or of what networks that see whole frames are given of them, that inference
    /// clamps: those outside the training range by more than an eighth of it.
    ///
    /// # Panics
    /// If `readings` are not whole frames of the model.
    pub fn share_out_of_range(&self, readings: &[f64]) -> f64 {
        let (mut clamped, mut present) = (0_usize, 0_usize);
        for (networks, inputs) in self.tables(readings) {
            let range = |network: &Network<'_>, input| network.training_range(input).map(f64::from);
            let of_network =
                |it: &Network<'b>| (0..it.shape().inputs).map(|i| range(it, i)).collect::<Vec<_>>();
            let ranges: Vec<[f64; 2]> = networks.iter().flat_map(of_network).collect();
            for line in inputs.chunks_exact(ranges.len().max(1)) {
                for (reading, [lowest, highest]) in line.iter().zip(&ranges) {
                    if !is_missing(*reading) {
                        let place = (reading - lowest) / (highest - lowest);
                        let inside = (f64::from(CLAMP[0])..=f64::from(CLAMP[1])).contains(&place);
                        present += 1;
                        clamped += usize::from(highest > lowest && !inside);
                    }
                }
            }
        }
        clamped as f64 / present.max(1) as f64
    }

    /// Networks that share a table of inputs, each table with the inputs for `readings`: all networks of rows, or one that
    /// sees whole frames.
    fn tables(&self, readings: &[f64]) -> impl Iterator<Item = (&[Network<'b>], Vec<f64>)> {
        let at_once = if self.fronts.is_empty() { self.networks.len() } else { 1 };
        self.networks.chunks(at_once).zip(self.inputs_of_networks(readings))
    }
}

impl FrameDecoder for PreparedModel<'_> {
    type State = ();

    fn name(&self) -> &'static str {
        "network"
    }

    fn inputs(&self) -> usize {
        let shape = self.model.shape();
        shape.rows * shape.inputs
    }

    fn decode(&self, (): &mut (), frames: Frames<'_>) -> Estimates {
        // Novelty and deviations are asked for apart (`assess`): tables of errors do not need them.
        Estimates::of_values(self.decode_lines(frames.readings))
    }
}
