//! Errors of contacts by their depth: where a shallow contact is, readings hardly tell.

use serde::Serialize;
use taxel_data::Table;

use crate::metrics::{self, Errors, Measure, RELATIVE_THRESHOLD};

/// Column of true depths.
const DEPTH: &str = "contact_depth_mm";

/// Ranges of depth, as shares of full scale: five that cover all frames, and then all that are not shallow.
const RANGES: [[f64; 2]; 6] = [
    [0.0, 0.05],
    [0.05, RELATIVE_THRESHOLD],
    [RELATIVE_THRESHOLD, 0.2],
    [0.2, 0.5],
    [0.5, f64::INFINITY],
    [RELATIVE_THRESHOLD, f64::INFINITY],
];

/// Errors on the frames whose contact has a depth in some range.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DepthErrors {
    /// Least depth in mm.
    pub from_mm: f64,
    /// Depth in mm that is not reached; `None` for no bound.
    pub to_mm: Option<f64>,
    pub frames: usize,
    /// Errors by group of outputs.
    pub errors: Vec<Errors>,
}

impl DepthErrors {
    /// Range of depth in words.
    pub fn range(&self) -> String {
        match self.to_mm {
            Some(to_mm) => format!("{} to {to_mm} mm", self.from_mm),
            None => format!("from {} mm", self.from_mm),
        }
    }
}

/// Errors by the true depth of the contact; nothing for outputs without it.
///
/// `estimate` is laid out like `truth`, `lines × columns`. The last range holds all frames that are deeper than
/// [`RELATIVE_THRESHOLD`] of full scale.
///
/// # Panics
/// If `estimate` is not as long as `truth`, or `measure` does not have one full scale a column.
pub fn by_depth(truth: &Table, estimate: &[f64], measure: &Measure) -> Vec<DepthErrors> {
    let width = truth.names.len();
    let Some(column) = truth.names.iter().position(|name| name == DEPTH) else { return vec![] };
    let full_scale = measure.full_scale[column];
    // Ratios to the limit belong to frames in their order.
    let measure = Measure { limit: None, ..measure.clone() };
    let of_range = |[low, high]: [f64; 2]| {
        let [from_mm, to_mm] = [low, high].map(|share| rounded(share * full_scale));
        let (mut chosen, mut estimates) =
            (Table { names: truth.names.clone(), values: vec![] }, vec![]);
        for (line, estimate) in truth.lines().zip(estimate.chunks_exact(width)) {
            if (from_mm..to_mm).contains(&line[column]) {
                chosen.values.extend_from_slice(line);
                estimates.extend_from_slice(estimate);
            }
        }
        DepthErrors {
            from_mm,
            to_mm: to_mm.is_finite().then_some(to_mm),
            frames: chosen.len(),
            errors: metrics::by_group(&chosen, &estimates, &measure),
        }
    };
    RANGES.map(of_range).into_iter().filter(|range| range.frames > 0).collect()
}

/// A depth in whole micrometres, as people read it.
fn rounded(depth_mm: f64) -> f64 {
    (depth_mm * 1e3).round() / 1e3
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_told_apart_by_their_true_depth() {
        let names = ["contact_x_mm", DEPTH].map(String::from).to_vec();
        // The shallow contact is 4 mm off, those that are deeper 1 mm and 0.
        let truth = Table { names, values: vec![10.0, 0.02, 10.0, 0.1, 10.0, 0.9] };
        let estimate = [14.0, 0.02, 9.0, 0.1, 10.0, 0.9];
        let measure = Measure { full_scale: vec![20.0, 1.0], thickness_mm: None, limit: None };
        let found = by_depth(&truth, &estimate, &measure);
        let of = |range: &DepthErrors| (range.range(), range.frames, range.errors[0].rmse);
        assert_eq!(of(&found[0]), ("0 to 0.05 mm".into(), 1, 4.0));
        assert_eq!(of(&found[1]), ("0.1 to 0.2 mm".into(), 1, 1.0));
        assert_eq!(of(&found[2]), ("from 0.5 mm".into(), 1, 0.0));
        assert_eq!(of(&found[3]), ("from 0.1 mm".into(), 2, 0.5_f64.sqrt()));
        assert_eq!(found.len(), 4, "no frame is between 0.05 and 0.1 mm");
        let other = Table { names: vec!["fx_n".into()], values: vec![1.0] };
        assert!(by_depth(&other, &[1.0], &Measure { full_scale: vec![1.0], ..measure }).is_empty());
    }
}
