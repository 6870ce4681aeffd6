//! Readings relative to the baseline, R/R₀: inputs that a drift of the gain leaves as they are.
//!
//! [`taxel_core::relative`] has the arithmetic, which a device shares bit for bit.

use taxel_core::relative::{reciprocal, relative};
use taxel_data::{Dataset, Table};

/// Reciprocals 1/R₀ of a `baseline`, rounded to `f32` first; NaN for a channel without one.
pub(crate) fn reciprocals(baseline: &[f64]) -> Vec<f32> {
    baseline.iter().map(|baseline| reciprocal(*baseline as f32)).collect()
}

/// One line of readings relative to the baseline, from the `reciprocals` of the latter.
pub(crate) fn ratios<'l>(
    readings: &'l [f64],
    reciprocals: &'l [f32],
) -> impl Iterator<Item = f64> + 'l {
    let pairs = readings.iter().zip(reciprocals);
    pairs.map(|(reading, reciprocal)| f64::from(relative(*reading as f32, *reciprocal)))
}

/// Divides `readings` by `baselines` of the same columns: one line for all frames, or a line for each.
///
/// A ratio is NaN where a reading is missing, or its baseline missing, zero or negative.
///
/// # Panics
/// If the columns differ in number, or the baselines are neither one nor as many as the readings' lines.
///
/// ```
/// use taxel_data::table::Table;
/// let names = vec!["ch1".to_owned(), "ch2".to_owned()];
/// let readings = Table { names: names.clone(), values: vec![30.0, 8.0, 15.0, 4.0].into() };
/// let baseline = Table { names, values: vec![60.0, 16.0].into() };
/// assert_eq!(taxel_learn::relative::inputs(&readings, &baseline).values, [0.5, 0.5, 0.25, 0.25]);
/// ```
pub fn inputs(readings: &Table, baselines: &Table) -> Table {
    assert_eq!(readings.names.len(), baselines.names.len(), "a baseline for every column");
    let lines = readings.lines();
    let values = if baselines.len() == 1 {
        let reciprocals = reciprocals(&baselines.values);
        lines.flat_map(|line| ratios(line, &reciprocals).collect::<Vec<_>>()).collect()
    } else {
        assert_eq!(readings.len(), baselines.len(), "one baseline, or one for every line");
        let pairs = lines.zip(baselines.lines());
        pairs
            .flat_map(|(line, baseline)| ratios(line, &reciprocals(baseline)).collect::<Vec<_>>())
            .collect()
    };
    Table { names: readings.names.clone(), values }
}

/// Makes the inputs of `dataset`, which are readings, relative to `baselines` ([`inputs`]). Networks that are
/// trained on the result take such inputs, and their blob says so.
///
/// # Panics
/// As [`inputs`] does, and if the inputs are relative already.
pub fn dataset(dataset: Dataset, baselines: &Table) -> Dataset {
    assert!(!dataset.relative_inputs, "the inputs are readings");
    Dataset { inputs: inputs(&dataset.inputs, baselines), relative_inputs: true, ..dataset }
}
