//! Common parts of `emulate` and `link … check`: the plan, the model, and the page.

use std::path::Path;

use crate::experiment::names_a_scene;
use crate::report::Sections;
use crate::{Error, Result};
use clap::Args;
use taxel_core::blob::Model;
use taxel_data::{DataFile, Rest, Stream};
use taxel_learn::ModelBlob;
use taxel_rig::device::check::{Findings, Frames, Plan};
use taxel_simulate::synth::BASELINE_FRAMES;
use taxel_simulate::{Synthesis, synthesise};

use super::data_file::FieldArguments;
use super::filter_arguments::{FilterArguments, PeriodArgument, cycled};
use super::progress::Terminal;
use super::readings::model_inputs;
use super::rest_argument::UntouchedArguments;
use super::scene_argument::{FramesArgument, ModelArgument, SceneArgument};
use super::{Common, device_lines, print};

/// Time in µs from one frame of a scene to the next.
const PERIOD_US: u32 = 10_000;

/// Options of a check.
#[derive(Args)]
#[command(
    mut_arg("scene", |it| it.help("A built-in scene (paper, press, contact, moving, shear), the path of a scene file, or a CSV file \
                                   with the readings of --model")),
    mut_arg("model", |it| it.help("Weight blob for the device; without one, a model is trained on the scene")),
    mut_arg("frames", |it| it.help("Number of frames; lines of a CSV file are repeated if there are fewer"))
)]
pub struct CheckArguments {
    #[command(flatten)]
    scene: SceneArgument,
    #[command(flatten)]
    of: ModelArgument,
    #[command(flatten)]
    untouched: UntouchedArguments,
    #[command(flatten)]
    filter: FilterArguments,
    #[command(flatten)]
    period: PeriodArgument,
    #[command(flatten)]
    count: FramesArgument,
}

/// What a device is checked with.
pub struct Checked {
    /// Readings and baseline in Ω, in the columns of the model's inputs.
    pub frames: Frames,
    /// Model of the device.
    pub model: ModelBlob,
}

impl CheckArguments {
    /// Loads readings and model, which is trained if none was given.
    pub fn load(&self, common: &Common) -> Result<Checked> {
        if names_a_scene(self.scene.name()) {
            self.load_scene(common)
        } else {
            self.load_csv(common)
        }
    }

    fn load_csv(&self, common: &Common) -> Result<Checked> {
        let Some(path) = &self.of.model else {
            return Err(Error::Usage(format!(
                "{}: readings of a CSV file need --model FILE; `taxel train` makes one",
                self.scene.name()
            )));
        };
        let model = ModelBlob::read(path)?;
        let file = DataFile::read(self.scene.path())?;
        let readings = model_inputs(&model.prepare(), &file)?;
        let parsed = model.parse();
        let metadata = parsed.metadata();
        let rest = self.untouched.rest_if_relative(&file, metadata, None, common)?;
        let baseline_ohm = self.baseline_ohm(&parsed, path, rest.as_ref(), common)?;
        let count = self.count.frames.max(1);
        let start_us = if self.filter.settings().is_on() {
            cycled(&self.period.of_file(&file)?, count)
        } else {
            self.period.even(count, PERIOD_US)
        };
        let frames = Frames { readings: readings.cycled(count), baseline_ohm, start_us };
        Ok(Checked { frames, model })
    }

    /// Baseline of which all readings are believed, or those of a tracker: the device is given the same one for all frames. It
    /// is that of the first lines at `rest`, unless a file was given for it.
    fn baseline_ohm(
        &self,
        model: &Model<'_>,
        path: &Path,
        rest: Option<&Rest>,
        common: &Common,
    ) -> Result<Option<Vec<f64>>> {
        let (fields, metadata) = (FieldArguments::default(), model.metadata());
        if model.tracker().is_some() && !metadata.relative_inputs {
            return self.untouched.baseline.read(metadata, (&fields, None), common);
        }
        let baseline =
            self.untouched.baselines(metadata, path, (rest, 1), &fields, None, common)?;
        Ok(baseline.map(|baseline| baseline.values.into_vec()))
    }

    fn load_scene(&self, common: &Common) -> Result<Checked> {
        let scene = self.scene.load_world(common)?;
        self.untouched.refuse("a scene makes its own baseline")?;
        scene.world.check_frames("-n", self.count.frames)?;
        let model = match &self.of.model {
            Some(path) => ModelBlob::read(path)?,
            None => self.scene.load(common)?.train(&Terminal::new(common))?,
        };
        let parsed = model.parse();
        let metadata = parsed.metadata();
        if metadata.scene_digest != scene.digest {
            common.remark(format_args!(
                "note: the model was trained on {:?}, not on this scene; its outputs can be compared \
                 all the same",
                metadata.name
            ));
        }
        let inputs = metadata.input_names;
        if !inputs.iter().eq(scene.world.reading_names().iter().map(String::as_str)) {
            return Err(Error::Usage(format!(
                "--model: it decodes other readings than those of scene {:?}; give the scene that it \
                 was trained on",
                scene.name
            )));
        }
        let path = self.of.model.as_deref().unwrap_or(self.scene.path());
        let takes_baseline = metadata.relative_inputs || parsed.tracker().is_some();
        let baseline_ohm = if takes_baseline && self.untouched.path().is_none() {
            // All frames are of one session, which does not drift.
            let session = Synthesis::new(&scene.world).drift(None);
            Some(session.baselines(Stream::Test, 1, BASELINE_FRAMES).values.into_vec())
        } else {
            self.baseline_ohm(&parsed, path, None, common)?
        };
        let readings = synthesise(&scene.world, Stream::Test, self.count.frames.max(1)).inputs;
        let start_us = self.period.even(readings.len(), PERIOD_US);
        let frames = Frames { readings, baseline_ohm, start_us };
        Ok(Checked { frames, model })
    }

    /// Plan of the check, with `window` frames on their way at a time.
    pub fn plan(&self, window: usize) -> Plan {
        Plan { window, filter: self.filter.settings() }
    }
}

/// Prints the findings. Wrong answers are a failure.
pub fn conclude(findings: &Findings, common: &Common) -> print::Outcome {
    let outcome = print::sections(common, &sections_of(findings));
    let sound = if findings.all_good() {
        Ok(())
    } else {
        Err(Error::failed(if findings.repeated > 0 || findings.damaged > 0 {
            format!(
                "the line is not reliable: {} requests had to be sent again, {} reports were damaged",
                findings.repeated, findings.damaged
            )
        } else {
            "the device failed a check: see above".into()
        }))
    };
    outcome.and(sound)
}

fn sections_of(f: &Findings) -> Sections {
    let mut result = Sections::new("Device compared with the host");
    device_lines::value(&mut result, &f.device);
    result.value("statistics", &f.statistics);
    result.value("frames", &f.frames);
    result.value("repeated", &f.repeated);
    result.value("damaged", &f.damaged);
    let d = &f.device;
    result.line(
        "device",
        format!("{}, firmware {}, room for {} × {} wires", d.board, d.firmware, d.rows, d.columns),
    );
    if let Some(m) = &d.model {
        result.line(
            "model",
            format!(
                "{} × {} readings to {} × {} outputs, weights in {}",
                m.rows,
                m.inputs,
                m.rows,
                m.outputs,
                if m.in_ram { "RAM" } else { "flash" }
            ),
        );
    }
    result.line(
        "frames",
        format!(
            "{} of {} bit-identical to the host's, {:.0} a second",
            f.frames.bit_identical, f.frames.frames, f.frames.frames_per_s
        ),
    );
    result
        .line("line", format!("{} requests sent again, {} damaged reports", f.repeated, f.damaged));
    let s = &f.statistics;
    result.line(
        "since its start",
        format!(
            "{} requests, {} bad packets, {} lost reports",
            s.requests, s.bad_packets, s.lost_reports
        ),
    );
    device_lines::memory(&mut result, &d.memory);
    result
}
