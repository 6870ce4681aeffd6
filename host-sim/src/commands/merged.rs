//! Results of a sweep or a comparison: the files that they are written to.

use std::path::{Path, PathBuf};

use crate::report::{self, Sections};
use crate::sweep::Merged;
use crate::{Error, Result};
use taxel_data::output::{self, check_writable};

use super::{Common, print};

/// Ends of the files' names, after the table's name.
const ENDS: [&str; 3] = [".csv", ".json", ".html"];

/// Files that results are written to, together.
pub struct Files {
    folder: PathBuf,
    stem: String,
}

impl Files {
    /// Files beside this `table`, whose name ends in .csv.
    ///
    /// # Errors
    /// [`Error::Usage`] for another name.
    pub fn of(table: &Path) -> Result<Self> {
        let name = table.file_name().and_then(|name| name.to_str());
        let stem = name.and_then(|name| name.strip_suffix(".csv")).filter(|stem| !stem.is_empty());
        let stem = stem.ok_or_else(|| {
            Error::Usage(format!("-o {}: give a file whose name ends in .csv", table.display()))
        })?;
        let folder = table.parent().filter(|folder| !folder.as_os_str().is_empty());
        Ok(Self { folder: folder.unwrap_or(Path::new(".")).into(), stem: stem.into() })
    }

    /// Checks before long work that they can be written, and would replace none of the `inputs`.
    pub fn check(&self, inputs: &[&Path]) -> Result<()> {
        if !self.folder.exists() {
            return Ok(());
        }
        let paths = ENDS.map(|end| self.folder.join(format!("{}{end}", self.stem)));
        paths.iter().try_for_each(|path| Ok(check_writable(path, inputs)?))
    }

    /// Writes the results and their `sections`; `command` is what the user typed.
    pub fn write(
        &self,
        merged: &Merged,
        sections: &Sections,
        command: &str,
        common: &Common,
    ) -> Result<()> {
        let page = sections.page(command);
        let texts = [report::points(merged).csv(), print::file_of(common, sections), page.html];
        let files = ENDS.iter().zip(texts).map(|(end, text)| (format!("{}{end}", self.stem), text));
        let files: Vec<_> = files.chain(page.figures).collect();
        Ok(output::write_folder(&self.folder, &files)?)
    }

    /// What their names begin with.
    pub fn stem(&self) -> &str {
        &self.stem
    }

    /// Names in words.
    pub fn names(&self) -> String {
        let first = self.folder.join(format!("{}{}", self.stem, ENDS[0]));
        let others = ENDS[1..].iter().map(|end| format!("{}{end}", self.stem));
        let others = others.chain([format!("{}/{}-…", report::FIGURES, self.stem)]);
        format!("{}, and beside it {}", first.display(), others.collect::<Vec<_>>().join(", "))
    }
}
