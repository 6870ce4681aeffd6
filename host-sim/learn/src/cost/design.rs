//! What the cost of decoding depends on: sizes and options of a model, without its numbers.

use taxel_core::blob::ModelShape;
use taxel_core::rbf::{Format, Network, Shape, fixed16, float32};
use taxel_firmware::capacity::WEIGHT_RAM_BYTES;

use crate::packing::ModelBlob;

/// Sizes and options of a model.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Design {
    /// Rows, and inputs and outputs a row.
    pub shape: ModelShape,
    /// The networks that the blob holds.
    pub networks: Vec<NetworkDesign>,
    /// Index of the network that decodes each row; of the one for all rows behind a projection.
    pub row_network: Vec<usize>,
    /// Whether one network decodes all rows, behind a projection of their readings to its inputs.
    pub projection: bool,
    /// Whether inputs are relative to the baseline.
    pub relative_inputs: bool,
    /// Whether the images copy the weights to RAM. Else they stay in flash.
    pub weights_in_ram: bool,
}

/// Sizes and options of one network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NetworkDesign {
    /// Number format.
    pub format: Format,
    /// Inputs, centres and outputs of the network.
    pub shape: Shape,
    /// Whether it has an affine tail.
    pub affine_tail: bool,
}

impl Design {
    /// The design of the model in `blob`.
    pub fn new(blob: &ModelBlob) -> Self {
        let model = blob.parse();
        let (shape, projection) = (model.shape(), model.projection().is_some());
        let rows = if projection { 1 } else { shape.rows };
        Self {
            shape,
            networks: model.networks().map(|network| NetworkDesign::new(&network)).collect(),
            row_network: (0..rows).filter_map(|row| model.network_of_row(row)).collect(),
            projection,
            relative_inputs: model.metadata().relative_inputs,
            weights_in_ram: blob.bytes().len() <= WEIGHT_RAM_BYTES,
        }
    }

    /// The design of a model with a network of its own for each row, which are all alike. `shape` is that of the
    /// model.
    pub fn of_rows(shape: ModelShape, format: Format, centres: usize, affine_tail: bool) -> Self {
        let ModelShape { rows, inputs, outputs } = shape;
        let shape_of_row = Shape { inputs, centres, outputs };
        let network = NetworkDesign { format, shape: shape_of_row, affine_tail };
        let design = Self {
            shape,
            networks: vec![network; rows],
            row_network: (0..rows).collect(),
            projection: false,
            relative_inputs: false,
            weights_in_ram: false,
        };
        design.in_ram_if_it_fits()
    }

    /// The design of a model with one network for all rows, behind a projection to as many features as a row has
    /// inputs. `shape` is that of the model.
    pub fn of_array(shape: ModelShape, format: Format, centres: usize, affine_tail: bool) -> Self {
        let outputs = shape.rows * shape.outputs;
        let one = ModelShape { rows: 1, outputs, ..shape };
        let of_one = Self::of_rows(one, format, centres, affine_tail);
        Self { shape, projection: true, ..of_one }.in_ram_if_it_fits()
    }

    /// This design with the weights where the images put them, going by its parameters alone.
    #[must_use]
    pub fn in_ram_if_it_fits(self) -> Self {
        Self { weights_in_ram: self.parameter_bytes() <= WEIGHT_RAM_BYTES, ..self }
    }

    /// Bytes of all parameters in a blob: networks and projection, without names and headers.
    pub fn parameter_bytes(&self) -> usize {
        let networks: usize = self.networks.iter().map(NetworkDesign::bytes).sum();
        networks + self.projection_bytes()
    }

    /// The network of each row; with a projection the one for all rows.
    pub fn row_networks(&self) -> impl Iterator<Item = &NetworkDesign> {
        self.row_network.iter().filter_map(|index| self.networks.get(*index))
    }

    /// Bytes of the projection's parameters in a blob; 0 without one.
    pub fn projection_bytes(&self) -> usize {
        let readings = self.shape.rows * self.shape.inputs;
        self.features() * (1 + readings) * size_of::<f32>()
    }

    /// Number of features that the readings are projected to; 0 without a projection.
    pub fn features(&self) -> usize {
        let inputs = self.networks.first().map_or(0, |network| network.shape.inputs);
        if self.projection { inputs } else { 0 }
    }
}

impl NetworkDesign {
    /// The design of `network`.
    pub fn new(network: &Network<'_>) -> Self {
        Self {
            format: network.format(),
            shape: network.shape(),
            affine_tail: network.has_affine_tail(),
        }
    }

    /// Bytes of the network's parameters in a blob.
    pub fn bytes(&self) -> usize {
        let Self { format, shape, affine_tail } = *self;
        let words = match format {
            Format::F32 => float32::Network::block_words(shape, affine_tail),
            Format::Fixed16 => fixed16::Network::block_words(shape, affine_tail),
        };
        words * size_of::<u32>()
    }
}
