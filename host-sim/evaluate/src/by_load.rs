//! Errors by the depth or the force of a contact: where a light touch is, readings hardly tell.

use taxel_data::{Table, columns, rest};

use crate::metrics::{self, Errors, Measure, RELATIVE_THRESHOLD};

/// Column of true depths.
const DEPTH: &str = "contact_depth_mm";

/// Ranges of depth, as shares of full scale: five that cover all frames, and then all that are not shallow.
const DEPTHS: [[f64; 2]; 6] = [
    [0.0, 0.05],
    [0.05, RELATIVE_THRESHOLD],
    [RELATIVE_THRESHOLD, 0.2],
    [0.2, 0.5],
    [0.5, f64::INFINITY],
    [RELATIVE_THRESHOLD, f64::INFINITY],
];

/// Range of all frames.
const ALL: [f64; 2] = [0.0, f64::INFINITY];

/// Ranges of a force, as shares of full scale: all frames, and those above a tenth and three tenths.
const FORCES: [[f64; 2]; 3] = [ALL, [RELATIVE_THRESHOLD, f64::INFINITY], [0.3, f64::INFINITY]];

/// Errors on the frames whose contact has a depth or a force in some range.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadErrors {
    /// Output whose true magnitude tells frames apart.
    pub load: String,
    /// Least magnitude.
    pub from: f64,
    /// Magnitude that is not reached; `None` for no bound.
    pub to: Option<f64>,
    /// Whether these are the frames alone whose place the model tells: below its least strength there is none.
    pub told: bool,
    pub frames: usize,
    /// Errors of the model by group of outputs.
    pub errors: Vec<Errors>,
    /// Errors of the centroid by group of outputs; empty where there is none.
    pub centroid: Vec<Errors>,
}

impl LoadErrors {
    /// Range in words.
    pub fn range(&self) -> String {
        let unit = columns::unit_of(&self.load);
        match self.to {
            _ if self.told => "position given".into(),
            Some(to) => format!("{} to {to} {unit}", self.from),
            None => format!("all from {} {unit}", self.from),
        }
        .trim_end()
        .into()
    }
}

/// Errors of the model's `estimate` and of the `centroid`'s by the true depth of the contact; of places without a depth, by
/// the last force. Nothing for other outputs. Where the model tells no place of some frames, the last of the ranges is of
/// all frames that it tells one of.
///
/// Estimates are laid out like `truth`, `lines × columns`. The last range of depth holds all frames that are deeper than
/// [`RELATIVE_THRESHOLD`] of full scale.
///
/// # Panics
/// If an estimate is not as long as `truth`, or `measure` does not have one full scale a column.
pub fn by_load(
    truth: &Table,
    estimate: &[f64],
    centroid: Option<&[f64]>,
    measure: &Measure,
) -> Vec<LoadErrors> {
    let names = &truth.names;
    let is_force = |name: &String| rest::is_zero_at_rest(name) && columns::row_of(name).is_none();
    let has_place = names.iter().any(|name| columns::is_place(name));
    let force = names.iter().rposition(is_force).filter(|_| has_place);
    let (column, ranges) = match (names.iter().position(|name| name == DEPTH), force) {
        (Some(depth), _) => (depth, &DEPTHS[..]),
        (None, Some(force)) => (force, &FORCES[..]),
        (None, None) => return vec![],
    };
    // Ratios to the limit belong to frames in their order.
    let measure = Measure { limit: None, ..measure.clone() };
    let places: Vec<usize> = (0..names.len()).filter(|i| columns::is_place(&names[*i])).collect();
    let estimates = estimate.chunks_exact(names.len());
    let is_told: Vec<bool> =
        estimates.map(|line| places.iter().all(|place| !line[*place].is_nan())).collect();
    let of_range = |(shares, told): (&[f64; 2], bool)| {
        let [from, to] = shares.map(|share| rounded(share * measure.full_scale[column]));
        let is_within = |line: &usize| {
            (from..to).contains(&truth.line(*line)[column].abs()) && (!told || is_told[*line])
        };
        let lines: Vec<usize> = (0..truth.len()).filter(is_within).collect();
        let chosen = truth.pick(&lines);
        let errors = |estimate: &[f64]| {
            let estimate = Table { names: names.clone(), values: estimate.to_vec().into() };
            metrics::by_group(&chosen, &estimate.pick(&lines).values, &measure)
        };
        LoadErrors {
            load: names[column].clone(),
            from,
            to: to.is_finite().then_some(to),
            told,
            frames: lines.len(),
            errors: errors(estimate),
            centroid: centroid.map(errors).unwrap_or_default(),
        }
    };
    let told = is_told.contains(&false).then_some((&ALL, true));
    let ranges = ranges.iter().map(|range| (range, false)).chain(told);
    ranges.map(of_range).filter(|range| range.frames > 0).collect()
}

/// A magnitude with three digits, as people read it.
fn rounded(magnitude: f64) -> f64 {
    format!("{magnitude:.2e}").parse().unwrap_or(magnitude)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_told_apart_by_their_true_depth_or_force() {
        let names = ["contact_x_mm", DEPTH].map(String::from).to_vec();
        // The shallow contact is 4 mm off, those that are deeper 1 mm and 0.
        let truth = Table { names, values: vec![10.0, 0.02, 10.0, 0.1, 10.0, 0.9].into() };
        let estimate = [14.0, 0.02, 9.0, 0.1, 10.0, 0.9];
        let measure =
            Measure { full_scale: vec![20.0, 1.0], thickness_mm: None, limit: None, noise: None };
        let found = by_load(&truth, &estimate, None, &measure);
        let of = |range: &LoadErrors| (range.range(), range.frames, range.errors[0].rmse);
        assert_eq!(of(&found[0]), ("0 to 0.05 mm".into(), 1, 4.0));
        assert_eq!(of(&found[1]), ("0.1 to 0.2 mm".into(), 1, 1.0));
        assert_eq!(of(&found[2]), ("all from 0.5 mm".into(), 1, 0.0));
        assert_eq!(of(&found[3]), ("all from 0.1 mm".into(), 2, 0.5_f64.sqrt()));
        assert_eq!(found.len(), 4, "no frame is between 0.05 and 0.1 mm");
        // Of a place and a force, from all frames to the firmest; a model of forces alone has no such table.
        let names = ["x_mm", "force_n"].map(String::from).to_vec();
        let truth = Table { names, values: vec![10.0, 0.05, 10.0, -0.2, 10.0, 0.9].into() };
        let found = by_load(&truth, &estimate, Some(&truth.values), &measure);
        let of = |range: &LoadErrors| (range.range(), range.frames, range.errors[0].rmse);
        assert_eq!(of(&found[1]), ("all from 0.1 N".into(), 2, 0.5_f64.sqrt()));
        assert_eq!(of(&found[2]), ("all from 0.3 N".into(), 1, 0.0));
        assert_eq!((found[0].frames, found[0].centroid[0].rmse, found.len()), (3, 0.0, 3));
        // The faintest touch has no place: it counts as the mean, and then the others have a range of their own.
        let faint = [f64::NAN, 0.05, 9.0, -0.2, 10.0, 0.9];
        let found = by_load(&truth, &faint, None, &measure);
        assert_eq!((of(&found[3]), found.len()), (("position given".into(), 2, 0.5_f64.sqrt()), 4));
        let other = Table { names: vec!["fx_n".into()], values: vec![1.0].into() };
        let measure = Measure { full_scale: vec![1.0], ..measure };
        assert!(by_load(&other, &[1.0], None, &measure).is_empty());
    }
}
