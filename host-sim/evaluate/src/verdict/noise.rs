//! What noise at rest is like, in words.

use taxel_data::spectrum::{NoiseColour, Spectrum};

use super::significant;

/// Noise at rest in sentences: its colour, its size, and how far averaging pays.
pub fn sentences(noise: &Spectrum) -> Vec<String> {
    let time = || {
        let constant = noise.time_constant_frames.map(significant).unwrap_or_default();
        match noise.time_constant_s {
            Some(s) => format!("{} ms", significant(1000.0 * s)),
            None => format!("{constant} frames"),
        }
    };
    let colour = match noise.colour {
        NoiseColour::White => {
            "The noise at rest is white: no correlation between frames stands out.".to_owned()
        }
        NoiseColour::Correlated => format!(
            "{:.0} % of the variance of the noise at rest has a time constant of {}; the rest is white.",
            100.0 * noise.correlated_share,
            time()
        ),
        NoiseColour::Slow => format!(
            "A part of the noise at rest changes more slowly than in {}: a drift, or noise with a time constant that takes a \
             longer log to tell. The rest is white.",
            time()
        ),
    };
    let mut said = vec![colour];
    if let Some([white, correlated]) = noise.levels {
        let percent = |level: f64| significant(100.0 * level);
        said.push(if correlated > 0.0 {
            format!(
                "Relative to the readings: {} % white and {} % with that memory.",
                percent(white),
                percent(correlated)
            )
        } else {
            format!("Relative to the readings: {} %.", percent(white))
        });
    }
    if let Some(best) = noise.best().filter(|best| best.frames > 1 || noise.pays_up_to.is_some()) {
        let left = format!(
            "{} of one frame's error (white noise: {})",
            significant(best.error),
            significant(best.white)
        );
        said.push(match noise.pays_up_to {
            Some(1) => "Averaging does not pay: the mean of two frames has hardly less error than one.".into(),
            Some(frames) => {
                format!("Averaging pays up to {frames} frames: their mean has {left}. Twice as many gain less than a tenth.")
            }
            None => format!(
                "Averaging pays as far as these frames tell: the mean of {} has {left}.",
                best.frames
            ),
        });
    }
    if noise.interval_s.is_none() {
        said.push(if noise.irregular {
            "Time is counted in frames: the rate of the log is not steady.".into()
        } else {
            "Time is counted in frames: nothing tells when they were read.".into()
        });
    }
    said
}
