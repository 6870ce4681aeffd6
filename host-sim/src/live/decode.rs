//! Decoding on the host, frame by frame, as a device does it.

use taxel_core::health::Limits;
use taxel_core::relative::reciprocal;
use taxel_core::track::{self, State, Tracker};
use taxel_core::{Decoder, Estimate, Frame, RowStatus};
use taxel_firmware::link::message::EstimateReport;
use taxel_learn::ModelBlob;

use super::moment::Moment;
use super::sheet;
use crate::{Error, Result};

/// Most rows of a model, as many as the blob format has numbers for.
const MOST_ROWS: usize = 255;

/// A model that decodes one frame after the other, and tracks a contact if it can.
pub struct FrameByFrame<'b> {
    decoder: Decoder<'b, MOST_ROWS>,
    tracker: Option<(Tracker<'b>, State)>,
    /// Limits of readings that are believed, where columns are in Ω.
    limits: Option<Limits>,
    /// One over each reading of the baseline; `None` of a model that takes readings as they are, until there is one.
    reciprocals: Option<Vec<f32>>,
    scratch: Vec<f32>,
}

impl<'b> FrameByFrame<'b> {
    /// Decoder by the model in `blob`, of readings with these `limits` if they are in Ω.
    ///
    /// # Errors
    /// Never, for a blob that was checked.
    pub fn new(blob: &'b ModelBlob, limits: Limits) -> Result<Self> {
        let decoder =
            Decoder::new(blob.parse()).map_err(|cause| Error::failed(cause.to_string()))?;
        let metadata = decoder.metadata();
        let limits = sheet::limits(metadata.input_names.iter(), limits);
        let readings = metadata.input_names.iter().count();
        let reciprocals = metadata.relative_inputs.then(|| vec![f32::NAN; readings]);
        let scratch = vec![0.0; decoder.scratch_floats()];
        let tracker = blob.parse().tracker().map(|tracker| (tracker, State::new()));
        Ok(Self { decoder, tracker, limits, reciprocals, scratch })
    }

    /// Whether the model tracks a contact from frame to frame.
    pub fn tracks(&self) -> bool {
        self.tracker.is_some()
    }

    /// What is to be said while the model divides readings by a baseline, and has none yet.
    pub fn note(&self) -> Option<String> {
        let lacks = self.reciprocals.as_ref().is_some_and(|all| all.iter().all(|it| it.is_nan()));
        let words = "nothing is decoded yet: the model needs a baseline of the untouched sensor; zero it (b)";
        lacks.then(|| words.into())
    }

    /// Takes the readings of the untouched sensor, for a model that divides by them, or a tracker.
    pub fn set_baseline(&mut self, readings: &[f32]) {
        self.reciprocals = Some(readings.iter().map(|reading| reciprocal(*reading)).collect());
        if let Some((_, state)) = &mut self.tracker {
            state.restart();
        }
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
        let measured = readings.clone();
        let reciprocals = self.reciprocals.as_deref();
        self.decoder.fill(&mut readings, reciprocals.unwrap_or_default(), &mut self.scratch);
        let frame = Frame { readings_ohm: &readings, reciprocals: reciprocals.unwrap_or_default() };
        let mut outputs = vec![f32::NAN; shape.rows * shape.outputs];
        let mut status = vec![RowStatus::MissingReading; shape.rows];
        let mut estimate = Estimate { outputs: &mut outputs, status: &mut status };
        let failed = |cause: taxel_core::rbf::NetworkError| Error::failed(cause.to_string());
        let clamped =
            self.decoder.decode_into(frame, &mut self.scratch, &mut estimate).map_err(failed)?;
        let mut is_tracked = false;
        if let Some((tracker, state)) = &mut self.tracker {
            let frame = track::Frame {
                readings_ohm: &measured,
                reciprocals,
                start_us: moment.frame.time_us,
                row_us: &vec![0.0; shape.rows],
            };
            is_tracked = tracker.track(state, &frame, 0.0, &mut estimate);
        }
        let mut deviations = vec![f32::NAN; outputs.len()];
        let novelty =
            self.decoder.assess_into(frame, &mut self.scratch, &mut deviations).map_err(failed)?;
        let flags = [
            (any_faulty, EstimateReport::FAULTY_READING),
            (status.contains(&RowStatus::Overflow), EstimateReport::OVERFLOW),
            (clamped && !is_tracked, EstimateReport::CLAMPED),
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

#[cfg(test)]
mod tests {
    use taxel_core::filter::Settings;
    use taxel_data::{Silent, Stream};
    use taxel_learn::tracked::{Series, decode_series};
    use taxel_recording::Frame;
    use taxel_simulate::Synthesis;

    use super::super::simulation::small_model;
    use super::*;
    use crate::experiment::Experiment;

    #[test]
    fn a_frame_is_decoded_and_flagged_as_a_data_file_is() {
        let text = Experiment::text("contact").unwrap();
        let text = text.replace("frames = 20000", "frames = 2000\nrelative_inputs = true");
        let scene = Experiment::parse("contact", &text).unwrap();
        let blob = small_model(&scene).unwrap();
        let table = Synthesis::new(&scene.world).frames(Stream::Test, 3).inputs;
        let baseline =
            Synthesis::new(&scene.world).untouched().ideal().frames(Stream::Test, 1).inputs;
        let model = blob.prepare().with_baseline(&baseline.values);
        let floats = |line: &[f64]| line.iter().map(|it| *it as f32).collect::<Vec<f32>>();
        let mut decoder = FrameByFrame::new(&blob, Limits::USUAL).unwrap();
        let decode = |readings: Vec<f32>, decoder: &mut FrameByFrame<'_>| {
            let mut moment = Moment::new(Frame { readings, ..Frame::default() });
            decoder.decode(&mut moment).unwrap();
            moment
        };
        let readings = floats(table.line(1));
        assert!(decoder.note().unwrap().contains("zero it"));
        let blind = decode(readings.clone(), &mut decoder);
        assert!(blind.frame.outputs.unwrap().iter().all(|it| it.is_nan()));
        decoder.set_baseline(&floats(baseline.line(0)));
        assert_eq!(decoder.note(), None);
        let same = |a: Vec<f32>, b: &[f64]| a.iter().map(|it| f64::from(*it)).eq(b.iter().copied());
        let seen = decode(readings.clone(), &mut decoder);
        assert!(same(seen.frame.outputs.unwrap(), model.decode_table(&table).line(1)));
        let (deviations, novelty) = model.assess(&table.values).unwrap();
        let outputs = deviations.len() / 3;
        assert!(same(seen.frame.deviations.unwrap(), &deviations[outputs..2 * outputs]));
        assert_eq!(seen.novelty.map(f64::from), Some(novelty[1]));
        assert_eq!((seen.flags, novelty[1] > 0.0), (0, false));
        // A reading beyond its limits is filled, and told; what nobody has seen is novel and clamped.
        let mut faulty = readings.clone();
        faulty[20] = 2000.0;
        let filled = decode(faulty, &mut decoder);
        assert!(filled.has(EstimateReport::FAULTY_READING) && filled.frame.readings[20] == 2000.0);
        assert!(filled.frame.outputs.unwrap().iter().all(|it| it.is_finite()));
        let far = decode(readings.iter().map(|it| 0.3 * it).collect(), &mut decoder);
        assert_eq!(far.flags, EstimateReport::NOVEL | EstimateReport::CLAMPED);
    }

    #[test]
    fn a_contact_is_tracked_as_in_a_data_file() {
        let mut scene = Experiment::load("moving").unwrap();
        (scene.frames, scene.training.refine, scene.training.track) = (1000, false, true);
        let blob = scene.train(&Silent).unwrap();
        let rest = Synthesis::new(&scene.world).untouched().frames(Stream::Test, 20).inputs;
        let start_us: Vec<u64> = (0..20).map(|frame| 10_000 * frame).collect();
        let model = blob.prepare();
        let mut decoder = FrameByFrame::new(&blob, Limits::USUAL).unwrap();
        let mut decoded = vec![model.decode_table(&rest).values];
        // Without a baseline, and then with one, which is of the same readings.
        for baseline in [None, Some(rest.line(0))] {
            if let Some(baseline) = baseline {
                decoder.set_baseline(&baseline.iter().map(|it| *it as f32).collect::<Vec<_>>());
            }
            let series = Series { start_us: &start_us, faulty: &[], baseline };
            let expected = decode_series(&model, &rest, series, Settings::default());
            for (line, time_us) in start_us.iter().copied().enumerate() {
                let readings = rest.line(line).iter().map(|it| *it as f32).collect();
                let mut moment = Moment::new(Frame { readings, time_us, ..Frame::default() });
                decoder.decode(&mut moment).unwrap();
                let outputs = moment.frame.outputs.unwrap();
                let outputs = outputs.iter().map(|it| f64::from(*it));
                assert!(outputs.eq(expected.line(line).iter().copied()));
            }
            assert!(!decoded.contains(&expected.values));
            decoded.push(expected.values);
        }
    }
}
