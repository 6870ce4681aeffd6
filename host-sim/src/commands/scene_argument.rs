//! Scene argument, and the overrides that commands share.

use std::path::{Path, PathBuf};

use crate::experiment::Experiment;
use crate::{Error, Result};
use clap::Args;
use taxel_data::columns;

use super::Common;
use super::arguments::of_option;

/// Scene that stands for none.
pub const DEFAULT_SCENE: &str = "press";

/// Scene, with the settings that are changed in it.
#[derive(Args)]
pub struct SceneArgument {
    /// A built-in scene (paper, press, contact, moving, shear) or the path of a scene file.
    #[arg(default_value = DEFAULT_SCENE)]
    scene: String,
}

impl Default for SceneArgument {
    fn default() -> Self {
        Self { scene: DEFAULT_SCENE.into() }
    }
}

impl SceneArgument {
    /// Makes an argument as if it had been given on the command line.
    pub fn new(scene: &str) -> Self {
        Self { scene: scene.into() }
    }

    /// Loads the scene and applies the overrides.
    pub fn load(&self, common: &Common) -> Result<Experiment> {
        let scene = self.load_world(common)?;
        scene.check_sizes().map_err(|cause| Error::of_scene(&self.scene, cause))?;
        Ok(scene)
    }

    /// Loads the scene for its world, whatever it says of training, and applies the overrides.
    pub fn load_world(&self, common: &Common) -> Result<Experiment> {
        let mut scene = Experiment::load_open(&self.scene)?;
        scene.world.seed = common.seed.unwrap_or(scene.world.seed);
        Ok(scene)
    }

    /// Scene, or the path of what is there in its place.
    pub fn name(&self) -> &str {
        &self.scene
    }

    /// Path of the scene, as an input that must not be replaced.
    pub fn path(&self) -> &Path {
        Path::new(&self.scene)
    }
}

/// Makes `scene` read one row-wire, numbered from 1 (`--row`).
pub fn read_one_row(scene: &mut Experiment, row: usize) -> Result<()> {
    let most = scene.world.sensor.row_wires;
    if !(1..=most).contains(&row) {
        return Err(Error::Usage(format!("--row {row}: the scene has rows 1 to {most}")));
    }
    scene.world.read_rows = vec![row - 1];
    Ok(())
}

/// Checks that `scene` has such a `group` of outputs (`--group`).
pub fn group_of_scene(scene: &Experiment, group: &str) -> Result<()> {
    let names = scene.world.output_names();
    let groups: Vec<&str> = columns::groups(&names).into_iter().map(|(name, _)| name).collect();
    if groups.contains(&group) {
        return Ok(());
    }
    Err(Error::Usage(format!("--group {group}: the scene has {}", groups.join(", "))))
}

/// Number of frames of a command that draws or repeats them.
#[derive(Args)]
pub struct FramesArgument {
    /// Frames to synthesise.
    #[arg(short = 'n', long, value_name = "N", default_value_t = 1000)]
    pub frames: usize,
}

/// Frames a second.
#[derive(Args)]
pub struct FrameRateArgument {
    /// Frames a second. `synth` uses it for the times of moving contacts or of the untouched sensor [default for moving
    /// contacts: the rate of the board]; `view` plays a simulation or a data file at this rate [default: 100, or by the
    /// file's times].
    #[arg(long, value_name = "HZ", value_parser = rate)]
    pub frame_rate: Option<f64>,
}

fn rate(text: &str) -> std::result::Result<f64, String> {
    let rate = text.parse().ok().filter(|rate: &f64| rate.is_finite() && *rate > 0.0);
    rate.ok_or_else(|| "give a positive number".into())
}

/// Model that decodes.
#[derive(Args)]
pub struct ModelArgument {
    /// Weight blob.
    #[arg(long, value_name = "BLOB")]
    pub model: Option<PathBuf>,
}

/// Noise level instead of the scene's.
#[derive(Args, Default)]
pub struct NoiseArgument {
    /// Level of the white noise, instead of the scene's: a fraction (0.01 is 1 %), or in ohm for absolute noise.
    #[arg(long, value_name = "LEVEL")]
    noise: Option<f64>,
}

impl NoiseArgument {
    /// Applies the level, if one was given.
    pub fn apply(&self, scene: &mut Experiment) -> Result<()> {
        let Some(level) = self.noise else { return Ok(()) };
        scene.world.set_noise_level(level).map_err(|bad| of_option(bad.named("--noise")))
    }

    /// Level, if one was given.
    pub fn level(&self) -> Option<f64> {
        self.noise
    }

    /// Whether a level was given.
    pub fn is_given(&self) -> bool {
        self.noise.is_some()
    }
}
