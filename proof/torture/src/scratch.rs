//! Folders of a test's own, and what is in them.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use taxel_data::output::Scratch;

/// Files of a folder, by their names.
pub type Files = BTreeMap<String, Vec<u8>>;

/// Folder that is removed with all that is in it.
#[derive(Debug)]
pub struct Folder(Scratch);

impl Folder {
    /// Makes a folder.
    pub fn new() -> Result<Self, String> {
        Scratch::new().map(Self).map_err(|cause| format!("no temporary folder: {cause}"))
    }

    /// Path of the folder.
    pub fn path(&self) -> &Path {
        self.0.path()
    }
}

/// Everything in a folder; a folder in it is named with a slash at the end.
pub fn files_of(folder: &Path) -> Result<Files, String> {
    let told = |cause| format!("{}: {cause}", folder.display());
    let mut files = Files::new();
    for entry in fs::read_dir(folder).map_err(told)? {
        let entry = entry.map_err(told)?;
        let name = entry.file_name().to_string_lossy().into_owned();
        if entry.path().is_dir() {
            files.insert(name + "/", Vec::new());
        } else {
            files.insert(name, fs::read(entry.path()).map_err(told)?);
        }
    }
    Ok(files)
}
