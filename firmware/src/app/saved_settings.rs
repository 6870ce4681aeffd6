//! Settings that are kept over restarts, as bytes: a version of each setting's own, and its postcard fields. Content of
//! another version is not believed.

use serde::{Deserialize, Serialize};
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
        Setting::Configuration => 5,
        Setting::Baseline => 3,
        Setting::Constants => 2,
    }
}

/// A baseline as it is kept.
#[derive(Serialize, Deserialize)]
struct Baseline<'b> {
    about: KeptBaseline,
    /// CRC-32 of the wires and of the constants that it was read with.
    origin_crc: u32,
    #[serde(borrow)]
    readings_ohm: Floats<'b>,
}

/// What is kept in `bytes` for `setting`.
fn read<'b, T: Deserialize<'b>>(setting: Setting, bytes: &'b [u8]) -> Option<T> {
    let (found, fields) = bytes.split_first()?;
    let (value, rest) = postcard::take_from_bytes(fields).ok()?;
    (*found == version(setting) && rest.is_empty()).then_some(value)
}

impl<F: FrameSource, const ROWS: usize> Sensor<'_, F, ROWS> {
    /// Puts the configuration and the constants that are kept in force.
    pub(super) fn load_settings<P: Platform>(&mut self, link: &mut Link<'_, P>) {
        if let Some(configuration) = link.kept_configuration() {
            self.configuration = configuration;
            info!("configuration as kept: a frame every {=u32} us", configuration.frame_period_us);
        }
        let kept = link.platform().journal().read(Kind::Constants);
        if let Some(constants) = kept.and_then(|bytes| read(Setting::Constants, bytes)) {
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
        let kept = link.platform().journal().read(Kind::Baseline);
        match kept.and_then(|bytes| read::<Baseline<'_>>(Setting::Baseline, bytes)) {
            Some(kept) if kept.origin_crc == origin_crc && kept.readings_ohm.0.len() == length => {
                self.baseline.restore(kept.readings_ohm, kept.about.frames);
                info!("baseline as kept: {=u16} frames", kept.about.frames);
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
        match setting {
            Setting::Configuration => link.keep(setting, &(version(setting), self.configuration)),
            Setting::Constants => {
                let constants = self.source.constants().ok_or(NOTHING)?;
                link.keep(setting, &(version(setting), constants))
            }
            Setting::Baseline => {
                let frames = self.baseline.frames();
                if frames == 0 || self.capture.is_some() {
                    return Err(NOTHING);
                }
                let (rows, columns) = (self.wiring.lines() as u8, self.wiring.line as u8);
                let about = KeptBaseline { rows, columns, frames };
                let readings_ohm = Floats::new(self.baseline.mean());
                let baseline = Baseline { about, origin_crc: self.origin_crc(), readings_ohm };
                link.keep(setting, &(version(setting), baseline))
            }
        }
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
        let bytes = self.platform().journal().read(Kind::Configuration)?;
        let kept: Configuration = read(Setting::Configuration, bytes)?;
        kept.check().is_ok().then_some(kept)
    }

    /// The settings that are kept.
    pub(super) fn kept(&mut self) -> Kept {
        let (configuration, writes_left) = (self.kept_configuration(), self.writes_left);
        let journal = self.platform().journal();
        let constants = journal.read(Kind::Constants);
        let constants =
            constants.and_then(|bytes| read::<Constants<'_>>(Setting::Constants, bytes));
        let baseline = journal.read(Kind::Baseline);
        let baseline = baseline.and_then(|bytes| read::<Baseline<'_>>(Setting::Baseline, bytes));
        Kept {
            configuration,
            constants: constants.is_some(),
            baseline: baseline.map(|kept| kept.about),
            writes_left,
        }
    }

    /// Keeps a setting no longer.
    pub(super) fn forget(&mut self, setting: Setting) -> Result<(), Refusal> {
        self.may_write()?;
        let written = self.platform().journal().keep(setting.into(), &[]);
        self.count_write(written)
    }
}
