//! Decoding on the host, frame by frame, as a device does it.

use taxel_core::health::Limits;
use taxel_core::relative::reciprocal;
use taxel_core::{Decoder, Estimate, Frame, RowStatus};
use taxel_firmware::link::message::EstimateReport;
use taxel_learn::ModelBlob;

use super::moment::Moment;
use super::sheet;
use crate::{Error, Result};

/// Most rows of a model, as many as the blob format has numbers for.
const MOST_ROWS: usize = 255;

/// A model that decodes one frame after the other.
pub struct FrameByFrame<'b> {
    decoder: Decoder<'b, MOST_ROWS>,
    /// Limits of readings that are believed, where columns are in Ω.
    limits: Option<Limits>,
    reciprocals: Vec<f32>,
    scratch: Vec<f32>,
}

impl<'b> FrameByFrame<'b> {
    /// Decoder by the model in `blob`.
    ///
    /// # Errors
    /// Never, for a blob that was checked.
    pub fn new(blob: &'b ModelBlob) -> Result<Self> {
        let decoder =
            Decoder::new(blob.parse()).map_err(|cause| Error::failed(cause.to_string()))?;
        let metadata = decoder.metadata();
        let limits = sheet::limits(metadata.input_names.iter());
        let readings = metadata.input_names.iter().count();
        let reciprocals = if metadata.relative_inputs { vec![f32::NAN; readings] } else { vec![] };
        let scratch = vec![0.0; decoder.scratch_floats()];
        Ok(Self { decoder, limits, reciprocals, scratch })
    }

    /// What is to be said while the model divides readings by a baseline, and has none yet.
    pub fn note(&self) -> Option<String> {
        let lacks = !self.reciprocals.is_empty() && self.reciprocals.iter().all(|it| it.is_nan());
        let words =
            "nothing is decoded yet: the model divides by the untouched sensor; zero it (b)";
        lacks.then(|| words.into())
    }

    /// Takes the readings of the untouched sensor, if the model divides by them.
    pub fn set_baseline(&mut self, readings: &[f32]) {
        let reciprocals = self.reciprocals.iter_mut().zip(readings);
        reciprocals.for_each(|(its, reading)| *its = reciprocal(*reading));
    }

    /// Decodes the readings of a moment, and says of it what a device would.
    ///
    /// # Errors
    /// If it has another number of readings than the model.
    pub fn decode(&mut self, moment: &mut Moment) -> Result<()> {
        let shape = self.decoder.shape();
        let mut readings = moment.frame.readings.clone();
        if readings.len() != shape.rows * shape.inputs {
            return Err(Error::Usage(format!(
                "a frame has {} readings, and MODEL takes {}: name the model of this sensor",
                readings.len(),
                shape.rows * shape.inputs
            )));
        }
        let is_faulty = |reading: &f32| match self.limits {
            Some(limits) => limits.fault(*reading).is_some(),
            None => !reading.is_finite(),
        };
        let mut any_faulty = false;
        for reading in readings.iter_mut().filter(|reading| is_faulty(reading)) {
            (*reading, any_faulty) = (f32::NAN, true);
        }
        self.decoder.fill(&mut readings, &self.reciprocals, &mut self.scratch);
        let frame = Frame { readings_ohm: &readings, reciprocals: &self.reciprocals };
        let mut outputs = vec![f32::NAN; shape.rows * shape.outputs];
        let mut status = vec![RowStatus::MissingReading; shape.rows];
        let mut estimate = Estimate { outputs: &mut outputs, status: &mut status };
        let failed = |cause: taxel_core::rbf::NetworkError| Error::failed(cause.to_string());
        let clamped =
            self.decoder.decode_into(frame, &mut self.scratch, &mut estimate).map_err(failed)?;
        let mut deviations = vec![f32::NAN; outputs.len()];
        let novelty =
            self.decoder.assess_into(frame, &mut self.scratch, &mut deviations).map_err(failed)?;
        let flags = [
            (any_faulty, EstimateReport::FAULTY_READING),
            (status.contains(&RowStatus::Overflow), EstimateReport::OVERFLOW),
            (clamped, EstimateReport::CLAMPED),
            (novelty.is_some_and(|novelty| novelty > 0.0), EstimateReport::NOVEL),
        ];
        moment.flags = flags.into_iter().filter(|(set, _)| *set).map(|(_, flag)| flag).sum();
        moment.row_status = status.iter().map(|status| *status as u8).collect();
        moment.novelty = novelty;
        moment.frame.deviations = novelty.map(|_| deviations);
        moment.frame.outputs = Some(outputs);
        Ok(())
    }
}
