//! Pictures of how numbers behave at the extremes, as SVG files: light or dark like the viewer.

mod chart;
mod condition;
mod recursion;
mod scale;

use std::fs;
use std::path::Path;

use crate::tools::Tools;

/// Writes all pictures into `folder`.
///
/// # Errors
/// A file cannot be written, or the program of host-sim is not built.
pub fn write(folder: &Path, tools: &Tools) -> Result<(), String> {
    fs::create_dir_all(folder).map_err(|cause| format!("{}: {cause}", folder.display()))?;
    let drawn = [
        ("condition-by-width.svg", condition::draw()),
        ("rls-over-updates.svg", recursion::draw()),
        ("error-by-scale.svg", scale::by_factor(tools)?),
        ("error-by-offset.svg", scale::by_offset(tools)?),
    ];
    for (name, drawing) in drawn {
        let path = folder.join(name);
        fs::write(&path, drawing).map_err(|cause| format!("{}: {cause}", path.display()))?;
        println!("{}", path.display());
    }
    Ok(())
}
