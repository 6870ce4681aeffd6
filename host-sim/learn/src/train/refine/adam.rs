//! Adam (Kingma & Ba, ICLR 2015), with a rate that falls along half a cosine.

/// Decay of the mean slope and of the mean squared slope.
const DECAYS: [f64; 2] = [0.9, 0.999];
/// Least denominator.
const LEAST: f64 = 1e-8;

/// State of the descent.
#[derive(Debug, Clone)]
pub struct Adam {
    rate: f64,
    steps: usize,
    step: usize,
    means: Vec<f64>,
    squares: Vec<f64>,
}

impl Adam {
    /// Descent over so many `steps`, which starts with `rate`.
    pub fn new(rate: f64, steps: usize, length: usize) -> Self {
        Self { rate, steps, step: 0, means: vec![0.0; length], squares: vec![0.0; length] }
    }

    /// Moves `values` one step down their `slopes`.
    pub fn descend(&mut self, values: &mut [f64], slopes: &[f64]) {
        let turn = std::f64::consts::PI * self.step as f64 / self.steps as f64;
        let rate = self.rate * 0.5 * (1.0 + libm::cos(turn));
        self.step += 1;
        let [mean_bias, square_bias] = DECAYS.map(|decay| 1.0 - libm::pow(decay, self.step as f64));
        let memory = self.means.iter_mut().zip(&mut self.squares);
        for ((value, slope), (mean, square)) in values.iter_mut().zip(slopes).zip(memory) {
            *mean += (1.0 - DECAYS[0]) * (slope - *mean);
            *square += (1.0 - DECAYS[1]) * (slope * slope - *square);
            *value -= rate * (*mean / mean_bias) / ((*square / square_bias).sqrt() + LEAST);
        }
    }
}
