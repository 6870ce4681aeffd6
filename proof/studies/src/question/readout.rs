//! Effect of a readout's faults on readings and estimates, one fault after another.

use serde::Serialize;
use taxel_data::random::Stream;
use taxel_data::table::Table;
use taxel_learn::PreparedModel;
use taxel_learn::decoders::mean;
use taxel_simulate::Synthesis;
use taxel_simulate::readout::{Circuit, Readout};
use taxel_simulate::synth::BASELINE_FRAMES;
use taxel_virtual_board::{
    VirtualBoard, all_readings, op_amp_time_constant_us, scan, untouched_readings,
};

use taxel_evaluate::experiment::Experiment;
use taxel_evaluate::metrics::{self, DecoderErrors, Errors, NETWORK};

/// Fault of a readout, together with all faults before it. Parts that a scene does not set have these
/// typical values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stage {
    /// Quantisation by a converter of 12 bits.
    Quantised,
    /// Cross-talk: all wires form one network.
    CrossTalk,
    /// Series resistance: 0.26 Ω in each row's switch (TS3A24159), 0.1 Ω in each wire's lead.
    Series,
    /// Series resistance that the firmware knows and corrects for.
    Corrected,
    /// Op-amp offsets within 0.5 mV (MCP6024), noise of half a count, and a time constant of 5 µs.
    Everything,
    /// Calibration error: the firmware takes all series resistance for a tenth larger than it is.
    Miscalibrated,
}

impl Stage {
    pub const ALL: [Self; 6] = [
        Self::Quantised,
        Self::CrossTalk,
        Self::Series,
        Self::Corrected,
        Self::Everything,
        Self::Miscalibrated,
    ];

    /// Name of the fault that the stage adds, for tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Quantised => "quantised",
            Self::CrossTalk => "+ cross-talk",
            Self::Series => "+ switch and line resistance",
            Self::Corrected => "the same, corrected",
            Self::Everything => "+ offset, noise, settling",
            Self::Miscalibrated => "the same, corrected 10 % wrong",
        }
    }

    /// Readout of this stage.
    pub fn readout(self, circuit: Circuit, of_scene: &Readout) -> Readout {
        let from = |stage: Self, given: Option<f64>, typical: f64| {
            (self as usize >= stage as usize).then(|| given.unwrap_or(typical))
        };
        Readout {
            circuit: Some(circuit),
            cross_talk: Some(self != Self::Quantised),
            row_switch_ohm: from(Self::Series, of_scene.row_switch_ohm, 0.26),
            line_ohm: from(Self::Series, of_scene.line_ohm, 0.1),
            op_amp_offset_v: from(Self::Everything, of_scene.op_amp_offset_v, 5e-4),
            adc_noise_counts: from(Self::Everything, of_scene.adc_noise_counts, 0.5),
            time_constant_us: from(
                Self::Everything,
                of_scene.time_constant_us,
                op_amp_time_constant_us(),
            ),
            ..of_scene.clone()
        }
    }
}

/// Errors of scanned readings against ideal ones.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ReadingErrors {
    /// Root mean square √mean((scanned/ideal − 1)²), in per cent.
    pub rms_percent: f64,
    /// Largest |scanned/ideal − 1|, in per cent.
    pub largest_percent: f64,
    /// Number of readings that could not be taken, open or shorted; they do not count above.
    pub missing: usize,
}

/// Result of one circuit with the faults of one stage.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Line {
    pub circuit: Circuit,
    pub stage: Stage,
    pub readings: ReadingErrors,
    /// Errors of the outputs decoded from them, by group.
    pub errors: Vec<Errors>,
}

/// Results of all circuits and stages on the same frames.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReadoutResult {
    pub subject: String,
    pub seed: u64,
    /// Number of frames that were scanned, without the scene's noise.
    pub frames: usize,
    /// CRC-32 of the model, in hexadecimal.
    pub model_crc: String,
    /// Errors of the network on ideal readings, then of always predicting the mean of these frames.
    pub decoders: Vec<DecoderErrors>,
    /// Results by circuit and stage.
    pub lines: Vec<Line>,
}

impl ReadoutResult {
    /// Errors of the network on ideal readings.
    pub fn ideal_errors(&self) -> &[Errors] {
        metrics::of_decoder(&self.decoders, NETWORK)
    }

    pub fn mean_errors(&self) -> &[Errors] {
        metrics::of_decoder(&self.decoders, mean::NAME)
    }
}

/// Scans `frames` of the scene with every circuit and stage and decodes them with `model`.
///
/// The model's columns must be the scene's. If its inputs are relative, each board captures a baseline of its own.
pub fn measure(
    experiment: &Experiment,
    model: &PreparedModel<'_>,
    frames: usize,
) -> taxel_simulate::Result<ReadoutResult> {
    let world = &experiment.world;
    let ideal_sensor = Synthesis::new(world).ideal().drift(None);
    let ideal = ideal_sensor.frames(Stream::Test, frames);
    let ideal_baseline = ideal_sensor.untouched().frames(Stream::Test, 1).inputs;
    let relative_inputs = model.model().metadata().relative_inputs;
    let untouched = relative_inputs.then(|| untouched_readings(world, BASELINE_FRAMES));
    let sensor = all_readings(world, frames);
    let measure = experiment.measure();
    let errors = |estimate: &[f64]| metrics::by_group(&ideal.outputs, estimate, &measure);
    let decode = |readings: &Table, baseline: &[f64]| {
        model.clone().with_baseline(baseline).decode_lines(&readings.values)
    };
    let mut lines = Vec::new();
    for circuit in Circuit::ALL {
        for stage in Stage::ALL {
            let board = VirtualBoard::with_readout(world, &stage.readout(circuit, &world.readout))?;
            let series = board.series_resistance().scaled(match stage {
                Stage::Quantised | Stage::CrossTalk | Stage::Series => 0.0,
                Stage::Corrected | Stage::Everything => 1.0,
                Stage::Miscalibrated => 1.1,
            });
            let scanned = scan(&board, series, &sensor)?;
            // A baseline is captured with the faults that frames are.
            let baseline = match &untouched {
                Some(untouched) => scan(&board, series, untouched)?.means(),
                None => ideal_baseline.values.clone(),
            };
            lines.push(Line {
                circuit,
                stage,
                readings: reading_errors(&scanned, &ideal.inputs),
                errors: errors(&decode(&scanned, &baseline)),
            });
        }
    }
    Ok(ReadoutResult {
        subject: experiment.name.clone(),
        seed: world.seed,
        frames,
        model_crc: format!("{:08x}", model.model().crc()),
        decoders: vec![
            DecoderErrors::new(NETWORK, errors(&decode(&ideal.inputs, &ideal_baseline.values))),
            DecoderErrors::new(mean::NAME, errors(&ideal.outputs.means().repeat(frames))),
        ],
        lines,
    })
}

fn reading_errors(scanned: &Table, ideal: &Table) -> ReadingErrors {
    let pairs = scanned.values.iter().zip(&ideal.values);
    let relative: Vec<f64> = pairs
        .filter(|(scanned, _)| scanned.is_finite() && **scanned > 0.0)
        .map(|(scanned, ideal)| (scanned / ideal - 1.0).abs())
        .collect();
    let squares: f64 = relative.iter().map(|error| error * error).sum();
    ReadingErrors {
        rms_percent: 100.0 * (squares / relative.len() as f64).sqrt(),
        largest_percent: 100.0 * relative.iter().fold(0.0, |a: f64, b| a.max(*b)),
        missing: scanned.values.len() - relative.len(),
    }
}
