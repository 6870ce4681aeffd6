//! Reading model of a sensor that has drifted, from the shifts that its networks were given.
//!
//! Means of readings move with the sensor, by mean(r) − m − L·f̄ over the presses: f̄ is where the presses lie in the
//! factors, on average. Of itself f̄ is as N(0, 1/n) of n presses; what networks are shifted by tells it better, since each
//! is given readings or features of them. That is one small problem of least squares, in units of the readings' noise.

use nalgebra::{DMatrix, DVector};
use taxel_core::blob::Model;
use taxel_core::reading_model::ReadingModel;

use crate::error::{Result, no_regression};
use crate::infer::{assess_lines, is_missing};
use crate::reading_model::{FALSE_ALARMS, quantile};

/// Numbers of the model's reading model, moved to where the `inputs` (`presses × readings`) of presses are. Networks were
/// given these `shifts`; `None` where they stayed. Deviations grow by `error`, in errors of training, and novelty's threshold
/// so that presses are as seldom novel as frames of training.
///
/// # Errors
/// [`Error`](crate::Error) for numbers beyond f32.
pub fn moved(
    model: &Model<'_>,
    own: ReadingModel<'_>,
    inputs: &[f64],
    shifts: &[Option<Vec<f64>>],
    error: f64,
) -> Result<Vec<f32>> {
    let sizes = own.sizes();
    let channels: Vec<_> = own.channels().collect();
    let presses = (inputs.len() / sizes.readings) as f64;
    let offset = |reading: usize| {
        let of_reading = inputs.iter().skip(reading).step_by(sizes.readings);
        let known: Vec<f64> = of_reading.copied().filter(|it| !is_missing(*it)).collect();
        let mean = known.iter().sum::<f64>() / known.len() as f64;
        if known.is_empty() { 0.0 } else { mean - f64::from(channels[reading].0) }
    };
    let offsets = DVector::from_fn(sizes.readings, |reading, _| offset(reading));
    let noise = |reading: usize| match channels[reading].1 {
        scale if scale > 0.0 => 1.0 / f64::from(scale),
        _ => 0.0,
    };
    let mut loadings = DMatrix::from_fn(sizes.readings, sizes.factors, |reading, factor| {
        f64::from(channels[reading].2[factor])
    });
    for mut column in loadings.column_iter_mut() {
        // The parts' squares sum up to 1 − 1/λ, with λ the variance along the factor.
        let variance = 1.0 / (1.0 - column.norm_squared()).max(1e-7);
        column.scale_mut(variance.sqrt());
    }
    for (reading, mut row) in loadings.row_iter_mut().enumerate() {
        row.scale_mut(noise(reading));
    }
    let mut matrix = DMatrix::identity(sizes.factors, sizes.factors) * presses;
    let mut sums = DVector::zeros(sizes.factors);
    // A network's input is a sum of readings, each times its part.
    let mut take = |parts: &[(usize, f64)], shift: f64| {
        let square: f64 = parts.iter().map(|(i, part)| (part * noise(*i)).powi(2)).sum();
        if square > 0.0 {
            let slope: DVector<f64> =
                parts.iter().map(|(i, part)| loadings.row(*i).transpose() * *part).sum();
            let offset: f64 = parts.iter().map(|(i, part)| offsets[*i] * part).sum();
            matrix.ger(1.0 / square, &slope, &slope, 1.0);
            sums.axpy((offset - shift) / square, &slope, 1.0);
        }
    };
    let fronts: Vec<_> = model.fronts().collect();
    for (index, shift) in shifts.iter().enumerate() {
        let front = fronts.get(index);
        let row = (0..model.shape().rows).find(|row| model.network_of_row(*row) == Some(index));
        let first = row.filter(|_| front.is_none()).unwrap_or(0) * model.shape().inputs;
        let projection = front.filter(|it| it.touch.is_none()).and_then(|it| it.projection);
        let count = match front {
            Some(_) => projection.map_or(sizes.readings, |it| it.features()),
            None => model.shape().inputs,
        };
        for number in 0..count {
            let parts: Vec<(usize, f64)> = match projection {
                Some(it) => {
                    let parts = it.block().iter().skip(it.features() + number);
                    parts.step_by(it.features()).copied().map(f64::from).enumerate().collect()
                }
                None => vec![(first + number, 1.0)],
            };
            take(&parts, shift.as_ref().map_or(0.0, |shift| shift[number]));
        }
    }
    let factors = matrix.cholesky().ok_or_else(no_regression)?.solve(&sums);
    let explained = loadings * factors;
    let mut block = own.block().to_vec();
    for (reading, mean) in block.iter_mut().take(sizes.readings).enumerate() {
        *mean = (f64::from(*mean) + offsets[reading] - explained[reading]) as f32;
    }
    if own.assesses() {
        let ratios = block.len() - 1 - sizes.outputs;
        let variances = &mut block[ratios - sizes.components * sizes.outputs..ratios];
        let growth = error.max(1.0).powi(2);
        variances.iter_mut().for_each(|it| *it = (f64::from(*it) * growth) as f32);
        let model = ReadingModel::new(sizes, &block).map_err(|_| no_regression())?;
        let mut novelty = assess_lines(model, inputs).1;
        novelty.retain(|novelty| !novelty.is_nan());
        let beyond = quantile(&mut novelty, 1.0 - FALSE_ALARMS).max(0.0);
        if let Some(threshold) = block.last_mut() {
            *threshold += beyond as f32;
        }
    }
    Ok(block)
}
