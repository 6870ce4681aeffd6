//! Models laid out once for decoding frames and tables of any shape, bit for bit as a device does.

use std::borrow::Cow;

use model_core::blob::Model;
use model_core::rbf::Network;
use model_core::scale::CLAMP;
use taxel_data::table::Table;

use crate::decoder::{Estimates, FrameDecoder};
use crate::infer::{Exponential, Prepared, is_missing};
use crate::packing::ModelBlob;
use crate::train::projection;

/// Model that was parsed and laid out, ready to decode.
#[derive(Debug)]
pub struct PreparedModel<'b> {
    model: Model<'b>,
    /// Network of each row-wire, or the one network behind a projection.
    networks: Prepared<'b>,
    output_names: Vec<String>,
}

impl ModelBlob {
    /// Prepares the model for decoding with `exponential`; [`Exponential::default`] is that of the
    /// devices.
    ///
    /// # Panics
    /// Never: every row of a model that was checked has a network.
    #[must_use]
    pub fn prepare(&self, exponential: Exponential) -> PreparedModel<'_> {
        let model = self.parse();
        let networks: Vec<Network<'_>> = model.networks().collect();
        let of_row = |row| networks[model.network_of_row(row).expect("a row of the model")];
        let in_turn: Vec<Network<'_>> = match model.projection() {
            Some(_) => networks.clone(),
            None => (0..model.shape().rows).map(of_row).collect(),
        };
        let output_names = model.metadata().output_names.iter().map(String::from).collect();
        PreparedModel { networks: Prepared::new(&in_turn, exponential), output_names, model }
    }
}

impl<'b> PreparedModel<'b> {
    /// Parsed model: its shape, networks and metadata.
    #[must_use]
    pub fn model(&self) -> &Model<'b> {
        &self.model
    }

    /// Decodes a table of readings (`frames × inputs`, in the model's units) to one of outputs (`frames
    /// × outputs`).
    ///
    /// A missing reading makes the outputs of its row-wire NaN; behind a projection, all outputs of the
    /// frame.
    ///
    /// # Panics
    /// If the number of columns differs from the model's number of readings.
    #[must_use]
    pub fn decode_table(&self, readings: &Table) -> Table {
        assert_eq!(readings.names.len(), self.inputs(), "the model's inputs");
        Table { names: self.output_names.clone(), values: self.decode_lines(&readings.values) }
    }

    /// Decodes `readings` (`frames × inputs`) to outputs (`frames × outputs`), line after line.
    #[must_use]
    pub fn decode_lines(&self, readings: &[f64]) -> Vec<f64> {
        self.networks.infer(&self.inputs_of_networks(readings))
    }

    /// Inputs of the networks in turn: the readings, or features of them.
    fn inputs_of_networks<'r>(&self, readings: &'r [f64]) -> Cow<'r, [f64]> {
        match self.model.projection() {
            Some(projection) => {
                let features = self.model.shape().inputs;
                Cow::Owned(projection::features(projection, features, self.inputs(), readings))
            }
            None => Cow::Borrowed(readings),
        }
    }

    /// Share of `readings`, or of their features behind a projection, that inference clamps: those
    /// outside the training range by more than an eighth of it.
    ///
    /// # Panics
    /// If `readings` are not whole frames of the model.
    #[must_use]
    pub fn share_out_of_range(&self, readings: &[f64]) -> f64 {
        let inputs = self.networks.inputs();
        let readings = self.inputs_of_networks(readings);
        let range = |network: &Network<'_>, input| network.training_range(input).map(f64::from);
        let ranges: Vec<[f64; 2]> = self
            .networks
            .networks()
            .flat_map(|network| (0..inputs).map(move |input| range(network, input)))
            .collect();
        let (mut clamped, mut present) = (0_usize, 0_usize);
        for line in readings.chunks_exact(ranges.len().max(1)) {
            for (reading, [lowest, highest]) in line.iter().zip(&ranges) {
                if !is_missing(*reading) {
                    let place = (reading - lowest) / (highest - lowest);
                    let inside = (f64::from(CLAMP[0])..=f64::from(CLAMP[1])).contains(&place);
                    present += 1;
                    clamped += usize::from(highest > lowest && !inside);
                }
            }
        }
        clamped as f64 / present.max(1) as f64
    }
}

impl FrameDecoder for PreparedModel<'_> {
    type State = ();

    fn name(&self) -> &'static str {
        "network"
    }

    fn inputs(&self) -> usize {
        let shape = self.model.shape();
        shape.rows * shape.inputs
    }

    fn decode(&self, (): &mut (), readings: &[f64]) -> Estimates {
        Estimates::of_values(self.decode_lines(readings))
    }
}
