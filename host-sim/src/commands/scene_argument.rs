//! The scene argument, and the overrides that commands share.

use clap::Args;
use host_sim::Result;
use host_sim::scene::Scene;

use super::Common;

const DEFAULT_SCENE: &str = "paper";

/// A scene and what is changed in it.
#[derive(Args)]
pub struct SceneArgument {
    /// A built-in scene (paper, press) or the path of a scene file.
    #[arg(default_value = DEFAULT_SCENE)]
    scene: String,
    /// Noise level as a fraction (0.01 is 1 %), instead of the scene's.
    #[arg(long, value_name = "LEVEL")]
    noise: Option<f64>,
}

impl Default for SceneArgument {
    fn default() -> Self {
        Self { scene: DEFAULT_SCENE.into(), noise: None }
    }
}

impl SceneArgument {
    /// Loads the scene and applies the overrides.
    pub fn load(&self, common: &Common) -> Result<Scene> {
        let mut scene = Scene::load(&self.scene)?;
        scene.seed = common.seed.unwrap_or(scene.seed);
        if let Some(level) = self.noise {
            scene.set_noise_level(level)?;
        }
        Ok(scene)
    }
}
