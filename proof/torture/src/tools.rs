//! Programs that promises are tested with, besides the libraries.

use std::path::{Path, PathBuf};

use taxel_core::AlignedBytes;

/// Programs built by `cargo xtask torture`.
#[derive(Debug)]
pub struct Tools {
    /// Program of host-sim.
    pub program: Option<PathBuf>,
}

impl Tools {
    /// The program of host-sim.
    pub fn program(&self) -> Result<&Path, String> {
        let missing = || "host-sim is not built; run this by `cargo xtask torture`".to_owned();
        self.program.as_deref().ok_or_else(missing)
    }
}

/// The model `name` in the folder `testdata`.
pub fn tested_model(name: &str) -> Result<AlignedBytes, String> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata").join(name);
    let blob = std::fs::read(&path).map_err(|cause| format!("{}: {cause}", path.display()))?;
    Ok(AlignedBytes::copy_of(&blob))
}
