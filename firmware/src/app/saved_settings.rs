//! Settings that are kept over restarts, as bytes.
//!
//! The first byte is the version of what follows, of each setting its own; content of another version is not believed.
//!
//! - Configuration: postcard fields, as in the link.
//! - Constants: number of rows and of columns; reference and drive voltage; then source by row, feedback by column
//!   and series resistance by column.
//! - Baseline: number of lines and of readings in one, as in a health report, number of frames (u16), CRC-32 of the
//!   constants that it was read with and of the wires of its readings, readings.
//!
//! Numbers are little-endian; voltages and resistances are f32.

use taxel_core::Wires;
use taxel_core::blob::Floats;
use taxel_core::checksum::CRC_32;

use super::link::Link;
use super::sensor::Sensor;
use crate::circuit::Constants;
use crate::link::message::{Configuration, KeepFault, Kept, KeptBaseline, Refusal, Setting};
use crate::log::{info, warning};
use crate::platform::Platform;
use crate::readout::FrameSource;
use crate::store::Kind;

/// Version of what is kept for `setting`. Whoever changes the setting's fields must raise it.
const fn version(setting: Setting) -> u8 {
    match setting {
        // Earlier versions had other fields.
        Setting::Configuration => 4,
        // Before version 2 a baseline did not tell its wires.
        Setting::Baseline => 2,
        Setting::Constants => 1,
    }
}

/// Largest size of a configuration in bytes.
const CONFIGURATION_BYTES: usize = 64;

impl<F: FrameSource, const ROWS: usize> Sensor<'_, F, ROWS> {
    /// Puts the configuration and the constants that are kept in force.
    pub(super) fn load_settings<P: Platform>(&mut self, link: &mut Link<'_, P>) {
        if let Some(configuration) = link.kept_configuration() {
            self.configuration = configuration;
            info!("configuration as kept: a frame every {=u32} us", configuration.frame_period_us);
        }
        let journal = link.platform().journal();
        if let Some(constants) = journal.read(Kind::Constants).and_then(constants) {
            if self.source.set_constants(constants).is_ok() {
                info!("constants as kept: drive voltage {=f32} V", constants.drive_v);
            } else {
                warning!("the constants that are kept do not fit this image");
            }
        }
    }

    /// Puts the baseline that is kept in force, if it is of the wires that are scanned, and was read with the
    /// constants in force.
    pub(super) fn load_baseline<P: Platform>(&mut self, link: &mut Link<'_, P>) {
        let (origin_crc, length) = (self.origin_crc(), 4 * self.wiring.readings);
        match link.platform().journal().read(Kind::Baseline).and_then(baseline) {
            Some(kept) if kept.origin_crc == origin_crc && kept.readings.0.len() == length => {
                self.baseline.restore(kept.readings, kept.frames);
                info!("baseline as kept: {=u16} frames", kept.frames);
            }
            Some(_) => warning!("the baseline that is kept is of other wires or constants"),
            None => {}
        }
    }

    /// Keeps a setting that is in force.
    pub(super) fn keep<P: Platform>(
        &mut self,
        setting: Setting,
        link: &mut Link<'_, P>,
    ) -> Result<(), Refusal> {
        const NOTHING: Refusal = Refusal::Keep(KeepFault::Nothing);
        link.may_write()?;
        let origin_crc = self.origin_crc();
        let journal = link.platform().journal();
        let version = version(setting);
        let written = match setting {
            Setting::Configuration => {
                let mut bytes = [0; CONFIGURATION_BYTES];
                let fields = postcard::to_slice(&self.configuration, &mut bytes);
                let fields = fields.map_err(|_| Refusal::Keep(KeepFault::TooLarge))?;
                journal.keep(setting.into(), &[&[version], fields])
            }
            Setting::Constants => {
                let Some(c) = self.source.constants() else { return Err(NOTHING) };
                let (rows, columns) = (c.row_source_ohm.0.len() / 4, c.feedback_ohm.0.len() / 4);
                let parts: [&[u8]; 6] = [
                    &[version, rows as u8, columns as u8],
                    &c.reference_v.to_le_bytes(),
                    &c.drive_v.to_le_bytes(),
                    c.row_source_ohm.0,
                    c.feedback_ohm.0,
                    c.series_ohm.0,
                ];
                journal.keep(setting.into(), &parts)
            }
            Setting::Baseline => {
                let frames = self.baseline.frames();
                if frames == 0 || self.capture.is_some() {
                    return Err(NOTHING);
                }
                let [low, high] = frames.to_le_bytes();
                let (lines, line) = (self.wiring.lines(), self.wiring.line);
                let head = [version, lines as u8, line as u8, low, high];
                let readings = Floats::new(self.baseline.mean()).0;
                journal.keep(setting.into(), &[&head, &origin_crc.to_le_bytes(), readings])
            }
        };
        link.count_write(written)
    }

    /// CRC-32 of what readings come from: the wires, and the constants in force if there are any.
    pub(super) fn origin_crc(&self) -> u32 {
        let mut digest = CRC_32.digest();
        digest.update(&self.wiring.crc_32.to_le_bytes());
        let Some(c) = self.source.constants() else { return digest.finalize() };
        let voltages = [c.reference_v.to_le_bytes(), c.drive_v.to_le_bytes()];
        let resistances = [c.row_source_ohm.0, c.feedback_ohm.0, c.series_ohm.0];
        digest.update(voltages.as_flattened());
        resistances.iter().for_each(|bytes| digest.update(bytes));
        digest.finalize()
    }
}

impl<P: Platform> Link<'_, P> {
    /// The configuration that is kept.
    pub(super) fn kept_configuration(&mut self) -> Option<Configuration> {
        let journal = self.platform().journal();
        journal.read(Kind::Configuration).and_then(configuration)
    }

    /// The settings that are kept.
    pub(super) fn kept(&mut self) -> Kept {
        let writes_left = self.writes_left;
        let configuration = self.kept_configuration();
        let journal = self.platform().journal();
        let constants = journal.read(Kind::Constants).and_then(constants).is_some();
        let baseline = journal.read(Kind::Baseline).and_then(baseline);
        let baseline = baseline.map(|kept| KeptBaseline {
            rows: kept.rows,
            columns: kept.columns,
            frames: kept.frames,
        });
        Kept { configuration, constants, baseline, writes_left }
    }

    /// Keeps a setting no longer.
    pub(super) fn forget(&mut self, setting: Setting) -> Result<(), Refusal> {
        self.may_write()?;
        let written = self.platform().journal().keep(setting.into(), &[]);
        self.count_write(written)
    }
}

/// What follows the version, if it is the `setting`'s.
fn content(setting: Setting, bytes: &[u8]) -> Option<&[u8]> {
    let (found, content) = bytes.split_first()?;
    (*found == version(setting)).then_some(content)
}

fn configuration(bytes: &[u8]) -> Option<Configuration> {
    match postcard::take_from_bytes::<Configuration>(content(Setting::Configuration, bytes)?) {
        Ok((configuration, [])) => configuration.check().is_ok().then_some(configuration),
        _ => None,
    }
}

/// Constants of the numbers of rows and columns that they say; each number in its range.
fn constants(bytes: &[u8]) -> Option<Constants<'_>> {
    let (&[rows, columns], numbers) = content(Setting::Constants, bytes)?.split_first_chunk()?;
    let (reference, numbers) = numbers.split_first_chunk()?;
    let (drive, numbers) = numbers.split_first_chunk()?;
    let wires = Wires { rows: rows.into(), columns: columns.into() };
    let (row_source, numbers) = numbers.split_at_checked(4 * wires.rows)?;
    let (feedback, series) = numbers.split_at_checked(4 * wires.columns)?;
    let constants = Constants {
        reference_v: f32::from_le_bytes(*reference),
        drive_v: f32::from_le_bytes(*drive),
        row_source_ohm: Floats(row_source),
        feedback_ohm: Floats(feedback),
        series_ohm: Floats(series),
    };
    constants.check(wires).is_ok().then_some(constants)
}

/// A baseline as it is kept.
struct Baseline<'b> {
    rows: u8,
    columns: u8,
    frames: u16,
    origin_crc: u32,
    readings: Floats<'b>,
}

fn baseline(bytes: &[u8]) -> Option<Baseline<'_>> {
    let (&[rows, columns, low, high], rest) =
        content(Setting::Baseline, bytes)?.split_first_chunk()?;
    let (origin_crc, readings) = rest.split_first_chunk()?;
    let frames = u16::from_le_bytes([low, high]);
    let origin_crc = u32::from_le_bytes(*origin_crc);
    let readings = Floats(readings);
    (frames > 0).then_some(Baseline { rows, columns, frames, origin_crc, readings })
}
