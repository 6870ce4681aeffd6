//! What the outputs should be, on a scale on which they can be compared.

use taxel_data::{Dataset, Table, columns};

/// Mean of every output, and the factor that its deviations are weighed by.
///
/// Outputs of one [quantity](columns::quantity_of) are compared as they are: an error of 1 mm counts alike in all of
/// them. Those of different ones are compared by the largest standard deviation of each quantity, and those without a
/// known one by their own.
pub(super) struct Targets {
    means: Vec<f64>,
    weights: Vec<f64>,
    networks: usize,
}

impl Targets {
    pub(super) fn new(dataset: &Dataset, networks: usize) -> Self {
        let deviations = dataset.outputs.deviations();
        let quantities: Vec<&str> =
            dataset.outputs.names.iter().map(|name| columns::quantity_of(name)).collect();
        let largest = |quantity: &&str| {
            let same = quantities.iter().zip(&deviations).filter(|(other, _)| *other == quantity);
            same.map(|(_, deviation)| *deviation).fold(0.0, f64::max)
        };
        let weight = |(quantity, own): (&&str, &f64)| {
            let scale = if quantity.is_empty() { *own } else { largest(quantity) };
            if scale > 0.0 { 1.0 / scale } else { 0.0 }
        };
        let weights = quantities.iter().zip(&deviations).map(weight).collect();
        Self { means: dataset.outputs.means(), weights, networks }
    }

    /// Targets of network number `network`, frame after frame.
    pub(super) fn of_network(&self, outputs: &Table, network: usize) -> Table {
        let count = self.means.len() / self.networks;
        let first = network * count;
        let scales = || self.means[first..].iter().zip(&self.weights[first..]);
        let mut targets = outputs.columns(first, count);
        for line in targets.values.chunks_exact_mut(count) {
            let scaled = line.iter_mut().zip(scales());
            scaled.for_each(|(value, (mean, weight))| *value = (*value - mean) * weight);
        }
        targets
    }
}
