//! Results of a sweep or a comparison: the files that they are written to, and the page on the terminal.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::report::format::counted;
use crate::sweep::Merged;
use crate::{Error, Result, report};
use taxel_data::output::{self, check_writable};

use super::print;

/// Ends of the files' names, after the table's name.
const ENDS: [&str; 3] = [".csv", ".json", ".html"];
/// Settings that are printed.
const PRINTED: usize = 12;

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

    /// Writes them; `command` is what the user typed.
    pub fn write(&self, merged: &Merged, command: &str) -> Result<()> {
        let page = report::sweep_html(merged, &self.stem, command);
        let texts = [merged.csv(), print::json_text(merged)?, page.html];
        let files = ENDS.iter().zip(texts).map(|(end, text)| (format!("{}{end}", self.stem), text));
        let files: Vec<_> = files.chain(page.figures).collect();
        Ok(output::write_folder(&self.folder, &files)?)
    }

    /// Names in words.
    pub fn names(&self) -> String {
        let first = self.folder.join(format!("{}{}", self.stem, ENDS[0]));
        let others = ENDS[1..].iter().map(|end| format!("{}{end}", self.stem));
        let others = others.chain([format!("{}/{}-…", report::FIGURES, self.stem)]);
        format!("{}, and beside it {}", first.display(), others.collect::<Vec<_>>().join(", "))
    }
}

/// Front, and shares of the variance.
pub fn page(merged: &Merged) -> print::Page {
    let mut page = print::Page::default();
    let within = merged.settings.iter().filter(|setting| setting.is_within).count();
    let bounds = if merged.bounds.is_empty() {
        String::new()
    } else {
        format!(", {within} within the bounds")
    };
    let failed = match merged.failed().count() {
        0 => String::new(),
        failed => format!(", {failed} failed"),
    };
    page.line(format_args!(
        "{}: {}{failed}, {}{bounds}, {} on the front of {}",
        merged.plan,
        counted(merged.points.len(), "point"),
        counted(merged.settings.len(), "setting"),
        merged.front().len(),
        merged.objectives.join(", ")
    ));
    if let Some(sentence) = merged.none_within() {
        page.line(sentence);
    }
    for (note, count) in merged.notes() {
        let points = counted(count, "point");
        page.line(format_args!("{points} with {note}; the JSON says why of each"));
    }
    front(&mut page, merged);
    if !merged.effects.is_empty() {
        page.line("\nShare of the variance that each axis explains");
        shares(&mut page, merged);
    }
    page
}

/// Adds the share of each objective's variance that each axis explains.
fn shares(page: &mut print::Page, merged: &Merged) {
    let heads = [String::new()].into_iter().chain(merged.objectives.iter().cloned());
    let mut lines = vec![heads.collect::<Vec<_>>()];
    for field in merged.fields_with_effects() {
        let share = |objective: &String| {
            let effect = merged.effect(field, objective);
            effect.map_or("-".into(), |effect| format!("{:.0} %", 100.0 * effect.share))
        };
        let cells = merged.objectives.iter().map(share);
        lines.push([field.clone()].into_iter().chain(cells).collect());
    }
    table(page, &lines);
}

/// Table whose columns are as wide as they must be; the first is a name, the others are numbers.
pub fn table(page: &mut print::Page, lines: &[Vec<String>]) {
    let columns = lines.first().map_or(0, Vec::len);
    let width =
        |column: usize| lines.iter().map(|line| line[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    for line in lines {
        let mut text = format!("{:<width$}", line[0], width = widths[0]);
        for (cell, width) in line.iter().zip(&widths).skip(1) {
            let _ = write!(text, "  {cell:>width$}");
        }
        page.line(text.trim_end());
    }
}

/// Settings on the front, evenly chosen where they are many.
fn front(page: &mut print::Page, merged: &Merged) {
    let front = merged.front();
    let shown = report::evenly(front.len(), PRINTED);
    let head = report::setting_heads(merged).into_iter().chain(merged.objectives.iter().cloned());
    let mut lines = vec![head.collect::<Vec<_>>()];
    for place in &shown {
        let setting = front[*place];
        let results = merged.objectives.iter().map(|name| report::result_text(setting, name));
        lines.push(report::setting_cells(merged, setting).into_iter().chain(results).collect());
    }
    table(page, &lines);
    if front.len() > shown.len() {
        page.line(format_args!("({} of {}; the files have all)", shown.len(), front.len()));
    }
}
