//! What a readout does to readings, and to what is decoded from them, one fault after another.

use model_core::Frame;
use serde::Serialize;

use crate::dataset::Table;
use crate::error::Result;
use crate::evaluate::metrics::{self, Errors, Measure};
use crate::infer::Kernel;
use crate::model::{LoadedModel, Origin};
use crate::random::Stream;
use crate::scene::{Circuit, Readout, Scene};
use crate::synth::synthesise_ideal;
use crate::virtual_hardware::{COLUMNS, ROWS, SeriesResistance, VirtualBoard};

/// Faults, each with all before it. What a scene does not say takes these typical values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stage {
    /// A converter of 12 bits.
    Quantised,
    /// All wires in one network.
    CrossTalk,
    /// 0.26 Ω in each row's switch (TS3A24159), 0.1 Ω in each wire's lead.
    Series,
    /// The same, and the firmware knows it.
    Corrected,
    /// Op-amp offsets within 0.5 mV (MCP6024), noise of half a count, a time constant of 5 µs.
    Everything,
    /// The same, and the firmware takes all series resistance for a tenth larger than it is.
    Miscalibrated,
}

impl Stage {
    /// All stages in order.
    pub const ALL: [Self; 6] = [
        Self::Quantised,
        Self::CrossTalk,
        Self::Series,
        Self::Corrected,
        Self::Everything,
        Self::Miscalibrated,
    ];

    /// What is simulated, for tables.
    #[must_use]
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

    /// The readout of this stage.
    #[must_use]
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
            time_constant_us: from(Self::Everything, of_scene.time_constant_us, 5.0),
            ..of_scene.clone()
        }
    }
}

/// Errors of scanned readings against ideal ones.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ReadingErrors {
    /// √mean((scanned/ideal − 1)²), in per cent.
    pub rms_percent: f64,
    /// The largest |scanned/ideal − 1|, in per cent.
    pub largest_percent: f64,
    /// Readings that could not be taken, open or shorted; they do not count above.
    pub missing: usize,
}

/// One circuit with the faults of one stage.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Line {
    /// The circuit.
    pub circuit: Circuit,
    /// The faults.
    pub stage: Stage,
    /// What becomes of the readings.
    pub readings: ReadingErrors,
    /// What is decoded from them, against truth, by group.
    pub errors: Vec<Errors>,
}

/// All circuits and stages on the same frames.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReadoutResult {
    /// Name of the scene.
    pub scene: String,
    /// Seed of every draw.
    pub seed: u64,
    /// Frames that were scanned, without the scene's noise.
    pub frames: usize,
    /// CRC-32 of the model, in hexadecimal.
    pub model_crc: String,
    /// Errors of decoding the ideal readings.
    pub ideal_errors: Vec<Errors>,
    /// Errors of answering the mean of these frames.
    pub mean_errors: Vec<Errors>,
    /// Errors of decoding scanned readings.
    pub lines: Vec<Line>,
}

impl ReadoutResult {
    /// A line.
    #[must_use]
    pub fn line(&self, circuit: Circuit, stage: Stage) -> Option<&Line> {
        self.lines.iter().find(|line| line.circuit == circuit && line.stage == stage)
    }
}

/// Scans `frames` of `scene` with every circuit and stage and decodes them with `model`, whose
/// columns must be the scene's.
///
/// # Errors
/// [`Error`](crate::Error): a sensor that the virtual board does not have, or a transaction that its
/// parts refuse.
pub fn measure(scene: &Scene, model: &LoadedModel, frames: usize) -> Result<ReadoutResult> {
    let ideal = synthesise_ideal(scene, Stream::Test, frames);
    let sensor = all_readings(scene, frames);
    let origin = Origin::of_scene(scene);
    let measure = Measure { full_scale: origin.full_scale, thickness_mm: origin.thickness_mm };
    let errors = |estimate: &[f64]| metrics::by_group(&ideal.outputs, estimate, &measure);
    let decode = |readings: &Table| model.decode(Kernel::default(), readings).values;
    let mut lines = Vec::new();
    for circuit in Circuit::ALL {
        for stage in Stage::ALL {
            let readout = stage.readout(circuit, &scene.readout);
            let board = VirtualBoard::new(&Scene { readout, ..scene.clone() })?;
            let series = board.series_resistance().scaled(match stage {
                Stage::Quantised | Stage::CrossTalk | Stage::Series => 0.0,
                Stage::Corrected | Stage::Everything => 1.0,
                Stage::Miscalibrated => 1.1,
            });
            let scanned = rows_read(scene, &scan(&board, series, &sensor)?);
            lines.push(Line {
                circuit,
                stage,
                readings: reading_errors(&scanned, &ideal.inputs),
                errors: errors(&decode(&scanned)),
            });
        }
    }
    Ok(ReadoutResult {
        scene: scene.name.clone(),
        seed: scene.seed,
        frames,
        model_crc: format!("{:08x}", model.model().crc()),
        ideal_errors: errors(&decode(&ideal.inputs)),
        mean_errors: errors(&ideal.outputs.means().repeat(frames)),
        lines,
    })
}

/// Ideal readings of all row-wires, read or not: what a board is given.
#[must_use]
pub fn all_readings(scene: &Scene, frames: usize) -> Table {
    let whole = Scene { read_rows: (0..scene.sensor.row_wires).collect(), ..scene.clone() };
    synthesise_ideal(&whole, Stream::Test, frames).inputs
}

/// Scans every line of `readings` of all row-wires by the firmware's scanner on `board`.
///
/// # Errors
/// [`Error::Failed`](crate::Error::Failed): the board refused a transaction.
pub fn scan(board: &VirtualBoard, series: SeriesResistance, readings: &Table) -> Result<Table> {
    let mut scanner = board.scanner(series);
    let settings = board.scan_settings();
    let mut frame = Frame::<ROWS, COLUMNS>::missing();
    let mut values = Vec::with_capacity(readings.values.len());
    for line in readings.lines() {
        board.set_readings(line);
        scanner.scan(settings, &mut frame);
        let scanned = frame.row_column_resistance_ohm.as_flattened();
        values.extend(scanned.iter().map(|ohm| f64::from(*ohm)));
    }
    board.check()?;
    Ok(Table { names: readings.names.clone(), values })
}

/// Of readings of all row-wires those that `scene` reads: the columns of its models.
#[must_use]
pub fn rows_read(scene: &Scene, readings: &Table) -> Table {
    let columns = scene.sensor.column_wires;
    let rows = |line: &[f64]| -> Vec<f64> {
        let row = |row: &usize| line[row * columns..(row + 1) * columns].to_vec();
        scene.read_rows.iter().flat_map(row).collect()
    };
    Table { names: scene.reading_names(), values: readings.lines().flat_map(rows).collect() }
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
