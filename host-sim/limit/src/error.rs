//! Reasons for giving no limit.

/// Reason why a limit cannot be computed, or why its figure would not be sound.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// World whose gain drifts.
    #[error("a drift of the gain is not modelled")]
    Drift,
    /// World without noise, in which nothing limits a decoder but the sensor itself.
    #[error("there is no noise, so there is no posterior to sample")]
    NoNoise,
    /// Errors on contacts that move, whose limit nobody asked for.
    #[error(
        "for contacts that move it takes a second or more per trajectory; ask for it with --limit-frames"
    )]
    Moving,
    /// Contacts that move, with something that is not modelled.
    #[error("for contacts that move, {0} is not modelled")]
    MovingWith(&'static str),
    /// Motion with more latents than the sampler can handle.
    #[error("{latents} unknowns at once are more than the {most} that the sampler can handle")]
    TooManyLatents {
        /// Number of latents that are sampled together.
        latents: usize,
        /// Largest number of latents.
        most: usize,
    },
    /// Frames with a posterior of too few effective samples.
    #[error(
        "{} of {of}: fewer than {least} effective samples, which are too few for a figure",
        numbered(frames)
    )]
    Thin {
        /// Numbers of these frames, from 1.
        frames: Vec<usize>,
        /// Number of frames.
        of: usize,
        /// Smallest effective sample size that counts.
        least: f64,
    },
    /// Posterior means whose own Monte Carlo error is too large a part of their error.
    #[error(
        "{share_percent:.1} % of the squared error of {group} is sampling error: the sample is too small for a figure"
    )]
    MonteCarlo {
        /// Group of outputs.
        group: String,
        /// Share of the mean squared error, in per cent.
        share_percent: f64,
    },
    /// Errors that are larger than the posteriors say: samples that missed a part of the posterior.
    #[error(
        "the errors of {group} and the posteriors' own deviations differ by {standard_errors:.1} standard errors: the \
         sample is not reliable enough for a figure"
    )]
    Inconsistent {
        /// Group of outputs.
        group: String,
        /// Difference of the mean squares, in standard errors.
        standard_errors: f64,
    },
    /// Measured data, of which neither the sensor nor the prior is known.
    #[error("the sensor and the prior of measured data are not known")]
    Measured,
}

/// Numbers of `frames`, the first few of them.
fn numbered(frames: &[usize]) -> String {
    const SHOWN: usize = 3;
    let mut words: Vec<String> = frames.iter().take(SHOWN).map(ToString::to_string).collect();
    if frames.len() > SHOWN {
        words.push(format!("{} more", frames.len() - SHOWN));
    }
    let last = words.pop().unwrap_or_default();
    if words.is_empty() {
        format!("test frame {last}")
    } else {
        format!("test frames {} and {last}", words.join(", "))
    }
}
