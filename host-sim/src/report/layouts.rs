//! Layouts of a sensor side by side: each with its least possible error and its best decoder.

use std::collections::BTreeSet;

use serde_json::Value;
use taxel_evaluate::sweep::Merged;
use taxel_evaluate::sweep::merge::{PointResult, layout_of};
use taxel_evaluate::sweep::plan::{SCENE, SEED};

use super::points;
use super::quantity::{Quantity, in_bounds};
use super::sections::{Sections, TableOf};

/// Sections of layouts, the `first` of which has no name in a plan of one alone.
pub fn sections(merged: &Merged, first: &str) -> Sections {
    let mut sections = Sections::new("Layouts compared");
    points::of_files(&mut sections, "compare");
    points::values(&mut sections, merged);
    table(&mut sections, merged, first);
    for failed in merged.failed() {
        sections.note(format!("Failed: {}.", reason(failed, first)));
    }
    let best = merged.best_of_layouts(first).into_iter();
    let best: Vec<_> = best.filter_map(|(name, best)| Some((name, best?))).collect();
    points::picture(&mut sections, merged, &best);
    let mut front = Sections::default();
    points::front_table(&mut front, merged);
    let mut more = vec![];
    if !merged.effects.is_empty() {
        more = points::effects(&mut sections, merged);
    }
    sections.folded("The Pareto front of all layouts", front.sections);
    sections.folded("Effects of the axes", more);
    points::counts(&mut sections, merged);
    sections
}

/// Adds a line for each layout.
fn table(sections: &mut Sections, merged: &Merged, first: &str) {
    let is_limit =
        |name: &&str| name.starts_with("limit_") && !name.starts_with("limit_standard_error_");
    let limits = merged.columns.iter().map(String::as_str).filter(is_limit);
    let error = merged.objectives.first().map(String::as_str);
    let sizes = ["rows", "columns", "area_cm2"];
    let costs = ["scan_ms", "frame_ms", "blob_bytes"];
    // Layouts that cannot be have no error, and its place is taken by a time.
    let mut seen = BTreeSet::new();
    let results: Vec<&str> = error.into_iter().chain(limits).chain(costs).chain(sizes).collect();
    let is_known = |name: &&str| merged.columns.iter().any(|known| known == name);
    let results: Vec<&str> =
        results.into_iter().filter(is_known).filter(|name| seen.insert(*name)).collect();
    let fields = merged.fields.iter().map(String::as_str);
    let fields: Vec<&str> = fields.filter(|field| ![SCENE, SEED].contains(field)).collect();
    let rows = merged.best_of_layouts(first);
    let bounds = match in_bounds(&merged.bounds) {
        bounds if bounds.is_empty() => String::new(),
        bounds => format!(" within the bound ({bounds})"),
    };
    let none = if rows.iter().any(|(_, best)| best.is_none()) {
        " A layout without numbers has no decoder within the bound."
    } else {
        ""
    };
    let caption = if merged.columns.iter().any(|name| name.starts_with("rmse_")) {
        let error = error.map_or(String::new(), |name| Quantity::of(name).heading);
        format!(
            "Layouts, each with the decoder of the smallest {error}{bounds}; of errors that count as equal, that of the fastest.{none}"
        )
    } else {
        format!("Layouts, each with its least possible error of any decoder.{none}")
    };
    let table = TableOf::new(&rows, caption).names("layout", "layout", |(name, _)| (*name).into());
    sections.table_as("layouts", points::with_results(table, (&fields, &results), |row| row.1));
}

/// Reason why a decoder of a layout has no result.
pub fn reason(point: &PointResult, first: &str) -> String {
    let why = point.failed.as_deref().unwrap_or_default().replace("scene of the point: ", "");
    let others = point.values.iter().filter(|(field, _)| ![SCENE, SEED].contains(&field.as_str()));
    let name = [layout_of(&point.values, first).to_owned()].into_iter();
    let name = name.chain(others.map(|(field, value): (_, &Value)| format!("{field} = {value}")));
    format!("{}: {why}", name.collect::<Vec<_>>().join(", "))
}
