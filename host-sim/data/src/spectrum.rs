//! Noise over time: whether readings at rest have white noise or noise with a memory, and how far averaging pays.
//!
//! The model is white noise, a first-order autoregressive part (AR(1)) of time constant τ, and a drift. Half the mean
//! squared difference of frames k apart is then, with the white variance w, the correlated variance a and one frame's
//! time Δ, γ(k) = w + a·(1 − exp(−kΔ/τ)) + d·k². Differences have no mean to subtract, so that γ is free of bias however
//! short the pauses of a log are. A drift that is slow beside the longest lag adds d·k², which is fitted with the rest.
//!
//! - γ is pooled over readings, each over its own γ at the middle lag. The autocorrelation is 1 − (γ − d·k²)/(w + a).
//! - For white noise, values of γ differ by sample autocorrelations, independent with variance 1/N (Bartlett, J. R. Stat.
//!   Soc. Suppl. 8, 1946). So weighted least squares give w, a and d for each τ, and the sum of squares tells how certain
//!   a correlation is. Readings that share their noise count as fewer, by their mean squared correlation.
//! - Allan deviations (Allan, Proc. IEEE 54, 1966) are those of the overlapping estimator (Riley, NIST SP 1065, 2008; IEEE
//!   Std 952). For white noise they fall with the root of the averaging time; a drift makes them rise.

use rayon::prelude::*;
use serde::Serialize;

use crate::elementary::exp;
use crate::table::Table;

mod fit;
mod series;

use fit::Fit;
use series::Series;

/// Standard errors of white noise by which a correlation must stand out. Of the 20 time constants that are tried, chance
/// reaches as much once in some ten thousand logs.
const CERTAIN: f64 = 5.0;
/// Longest time constant that is believed, as a share of the longest lag: what is slower might be a drift.
const LONGEST: f64 = 0.25;
/// Least share by which averaging twice as many frames must lower the error to pay.
pub const PAYS: f64 = 0.1;

/// What the noise on readings at rest is like.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum NoiseColour {
    /// No correlation between frames stands out.
    White,
    /// A part of it has a time constant.
    Correlated,
    /// A part of it changes so slowly that this log cannot tell a time constant from a drift.
    Slow,
}

/// Noise on readings at rest, over time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Spectrum {
    pub colour: NoiseColour,
    /// Frames and readings that tell it.
    pub frames: usize,
    pub readings: usize,
    /// Time between two frames; `None` if it is unknown or irregular, and time is counted in frames.
    pub interval_s: Option<f64>,
    /// Whether frames have times, but not at a steady rate.
    pub irregular: bool,
    /// Share of the correlated part in the variance; 0 if no time constant is known.
    pub correlated_share: f64,
    /// Time constant of the correlated part, or of what is slow at least.
    pub time_constant_frames: Option<f64>,
    /// Time constant in s, if the time between two frames is known.
    pub time_constant_s: Option<f64>,
    /// Standard deviations of the white and of the correlated part as fractions of a reading, root mean squares over
    /// readings; `None` where a reading is near zero.
    pub levels: Option<[f64; 2]>,
    pub autocorrelation: Vec<Lag>,
    pub averaging: Vec<Averaging>,
    /// Number of successive frames from which averaging twice as many lowers the error by less than a tenth, or from which
    /// the Allan deviation rises; `None` if averaging pays as far as the log tells.
    pub pays_up_to: Option<usize>,
}

/// Correlation of frames that are so far apart.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Lag {
    pub frames: usize,
    pub correlation: f64,
    /// Two standard errors of a white noise's correlation.
    pub bound: f64,
}

/// Means of so many successive frames. Deviations are fractions of a single frame's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Averaging {
    pub frames: usize,
    /// Allan deviation, as measured.
    pub allan: f64,
    /// Standard deviation that the white and the correlated part leave of a mean.
    pub error: f64,
    /// What white noise would leave of it.
    pub white: f64,
}

impl Spectrum {
    /// Noise on `readings` at rest, one frame a line. Frames follow one another where their `numbers` do, and their
    /// `times_s` if they are known. `None` for fewer than 40 frames, or if no reading changes.
    ///
    /// # Panics
    /// If there are not as many numbers, or times, as lines.
    pub fn new(readings: &Table, numbers: &[usize], times_s: Option<&[f64]>) -> Option<Self> {
        let series = Series::new(readings, numbers, times_s)?;
        let lags = series.lags()?;
        let curves = series.columns.par_iter().map(|column| series.variogram(column, &lags));
        let curves: Vec<Vec<f64>> = curves.collect();
        let scale = |curve: &Vec<f64>| curve[curve.len() / 2];
        let moving: Vec<usize> =
            (0..curves.len()).filter(|column| scale(&curves[*column]) > 0.0).collect();
        if moving.is_empty() {
            return None;
        }
        let pooled = |of: &dyn Fn(usize) -> f64| {
            moving.iter().map(|column| of(*column)).sum::<f64>() / moving.len() as f64
        };
        let curve: Vec<f64> = (0..lags.len())
            .map(|lag| pooled(&|column| curves[column][lag] / scale(&curves[column])))
            .collect();
        let independent = series.independent(&moving);
        let pairs: Vec<f64> = lags.iter().map(|lag| independent * series.pairs(*lag)).collect();
        let longest = *lags.last()? as f64;
        let white = Fit::white(&lags, &curve, &pairs)?;
        let found = Fit::correlated(&lags, &curve, &pairs, longest)
            .filter(|found| white.squares - found.squares > CERTAIN * CERTAIN);
        let colour = match found {
            None => NoiseColour::White,
            Some(found) if found.time_constant > LONGEST * longest => NoiseColour::Slow,
            Some(_) => NoiseColour::Correlated,
        };
        let fit = found.unwrap_or(white);
        // What is slow is taken for a drift: it is no part of the noise that is told of.
        let correlated = if colour == NoiseColour::Correlated { fit.correlated } else { 0.0 };
        let total = fit.white + correlated;
        if total <= 0.0 {
            return None;
        }
        let drift = |lag: usize| match colour {
            NoiseColour::Slow => fit.at(lag as f64) - fit.white,
            _ => fit.drift * (lag * lag) as f64,
        };
        let lag = |(place, frames): (usize, &usize)| Lag {
            frames: *frames,
            correlation: 1.0 - (curve[place] - drift(*frames)) / total,
            bound: 2.0 / pairs[place].sqrt(),
        };
        let decay = found.map_or(0.0, |found| exp(-1.0 / found.time_constant));
        let numbers = series.numbers_averaged();
        let allan = |frames: usize| {
            let of = moving.par_iter().map(|column| {
                series.allan_variance(&series.columns[*column], frames) / scale(&curves[*column])
            });
            (of.sum::<f64>() / moving.len() as f64 / total).sqrt()
        };
        let averaged = |frames: usize| Averaging {
            frames,
            allan: allan(frames),
            error: ((fit.white / frames as f64 + correlated * left_of_mean(frames, decay)) / total)
                .sqrt(),
            white: (1.0 / frames as f64).sqrt(),
        };
        let averaging: Vec<Averaging> = numbers.into_iter().map(averaged).collect();
        let stops = |pair: &[Averaging]| {
            let scatter = (pair[1].frames as f64 / (independent * series.frames() as f64)).sqrt();
            pair[1].error > (1.0 - PAYS) * pair[0].error
                || pair[1].allan > (1.0 + scatter) * pair[0].allan
        };
        let pays_up_to = averaging.windows(2).find(|pair| stops(pair)).map(|pair| pair[0].frames);
        let means = readings.means();
        let relative = |column: usize| {
            let mean = means[series.places[column]];
            scale(&curves[column]) * total / (mean * mean)
        };
        // Ten per cent of the mean: more is no level that noise can be a fraction of.
        let squares = moving.iter().all(|it| relative(*it) < 0.01).then(|| pooled(&relative));
        let time_constant_frames = found.map(|found| match colour {
            NoiseColour::Slow => LONGEST * longest,
            _ => found.time_constant,
        });
        Some(Self {
            colour,
            frames: series.frames(),
            readings: moving.len(),
            interval_s: series.interval_s,
            irregular: times_s.is_some() && series.interval_s.is_none(),
            correlated_share: correlated / total,
            time_constant_frames,
            time_constant_s: time_constant_frames.zip(series.interval_s).map(|(n, s)| n * s),
            levels: squares
                .map(|squares| [fit.white, correlated].map(|part| (squares * part / total).sqrt())),
            autocorrelation: lags.iter().enumerate().map(lag).collect(),
            averaging,
            pays_up_to,
        })
    }

    /// Variance of the noise over half the mean squared difference of neighbours: 1 for white noise.
    pub fn variance_over_differences(&self) -> f64 {
        let constant = self.time_constant_frames.filter(|_| self.colour == NoiseColour::Correlated);
        let shared = constant.map_or(0.0, |frames| self.correlated_share * exp(-1.0 / frames));
        1.0 / (1.0 - shared)
    }

    /// Averaging of the most frames that pay; of as many as the log tells, if all do.
    pub fn best(&self) -> Option<&Averaging> {
        let most = self.pays_up_to.unwrap_or(usize::MAX);
        self.averaging.iter().rfind(|it| it.frames <= most)
    }
}

/// Share of an AR(1) variance that is left of it in the mean of so many `samples`, of which neighbours have the correlation
/// `decay`: (n + 2·Σ (n − k)·decayᵏ)/n², with k from 1 to n − 1.
pub fn left_of_mean(samples: usize, decay: f64) -> f64 {
    let (mut power, mut sum) = (1.0, samples as f64);
    for apart in 1..samples {
        power *= decay;
        sum += 2.0 * (samples - apart) as f64 * power;
    }
    sum / (samples as f64).powi(2)
}

#[cfg(test)]
mod tests;
