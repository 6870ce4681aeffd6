//! The scene argument, and the overrides that commands share.

use clap::Args;
use host_sim::Result;
use host_sim::scene::Scene;

/// A scene and what is changed in it.
#[derive(Args)]
pub struct SceneArgument {
    /// A built-in scene (paper, press) or the path of a scene file.
    #[arg(default_value = "paper")]
    scene: String,
    /// Seed of every random draw, instead of the scene's.
    #[arg(long)]
    seed: Option<u64>,
    /// Noise level as a fraction (0.01 is 1 %), instead of the scene's.
    #[arg(long, value_name = "LEVEL")]
    noise: Option<f64>,
}

impl SceneArgument {
    /// Loads the scene and applies the overrides.
    pub fn load(&self) -> Result<Scene> {
        let mut scene = Scene::load(&self.scene)?;
        scene.seed = self.seed.unwrap_or(scene.seed);
        if let Some(level) = self.noise {
            scene.set_noise_level(level)?;
        }
        Ok(scene)
    }
}
