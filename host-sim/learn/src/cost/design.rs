//! What the cost of decoding depends on: sizes and options of a model, without its numbers.

use taxel_core::blob::{Front, ModelShape};
use taxel_core::rbf::{Format, Network, Shape, fixed16, float32};
use taxel_core::touch::{self, Touch};
use taxel_firmware::capacity::WEIGHT_RAM_BYTES;

use crate::packing::ModelBlob;

/// Sizes and options of a model.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Design {
    /// Rows, and inputs and outputs a row.
    pub shape: ModelShape,
    /// The networks that the blob holds.
    pub networks: Vec<NetworkDesign>,
    /// Index of the network that decodes each row; of each network in turn if they see whole frames.
    pub row_network: Vec<usize>,
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
    /// What stands before it, if it sees whole frames.
    pub front: Option<FrontDesign>,
}

/// What stands before a network that sees whole frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrontDesign {
    /// To which sides a touch moves readings; `None` for readings as they are.
    pub touch: Option<Sides>,
    /// Whether a projection makes the network's inputs.
    pub projection: bool,
}

/// Sides to which a touch moves readings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sides {
    /// Up or down.
    One,
    /// Either way.
    Both,
    /// Either way, without a threshold.
    Whole,
}

impl FrontDesign {
    /// The design of a `front`.
    pub fn new(front: &Front<'_>) -> Self {
        let sides = |touch: Touch<'_>| match touch.strengths().side {
            _ if touch.whole_changes() => Sides::Whole,
            0.0 => Sides::Both,
            _ => Sides::One,
        };
        Self { touch: front.touch.map(sides), projection: front.projection.is_some() }
    }

    /// Number of inputs of the projection, or of the network, from so many `readings` of a frame.
    pub fn seen(&self, readings: usize) -> usize {
        readings + usize::from(self.touch.is_some())
    }
}

impl Design {
    /// The design of the model in `blob`.
    pub fn new(blob: &ModelBlob) -> Self {
        let model = blob.parse();
        let mut networks: Vec<_> = model.networks().map(|it| NetworkDesign::new(&it)).collect();
        for (network, front) in networks.iter_mut().zip(model.fronts()) {
            network.front = Some(FrontDesign::new(&front));
        }
        let row_network = if model.whole_frames() {
            (0..networks.len()).collect()
        } else {
            (0..model.shape().rows).filter_map(|row| model.network_of_row(row)).collect()
        };
        Self {
            shape: model.shape(),
            networks,
            row_network,
            relative_inputs: model.metadata().relative_inputs,
            weights_in_ram: blob.bytes().len() <= WEIGHT_RAM_BYTES,
        }
    }

    /// The design of a model with a network of its own for each row, which are all alike. `shape` is that of the
    /// model.
    pub fn of_rows(shape: ModelShape, format: Format, centres: usize, affine_tail: bool) -> Self {
        let ModelShape { rows, inputs, outputs } = shape;
        let shape_of_row = Shape { inputs, centres, outputs };
        let network = NetworkDesign { format, shape: shape_of_row, affine_tail, front: None };
        let design = Self {
            shape,
            networks: vec![network; rows],
            row_network: (0..rows).collect(),
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
        let mut design = Self { shape, ..Self::of_rows(one, format, centres, affine_tail) };
        let front = Some(FrontDesign { touch: None, projection: true });
        design.networks.iter_mut().for_each(|network| network.front = front);
        design.in_ram_if_it_fits()
    }

    /// This design with the weights where the images put them, going by its parameters alone.
    #[must_use]
    pub fn in_ram_if_it_fits(self) -> Self {
        Self { weights_in_ram: self.parameter_bytes() <= WEIGHT_RAM_BYTES, ..self }
    }

    /// Bytes of all parameters in a blob: networks and their fronts, without names and headers.
    pub fn parameter_bytes(&self) -> usize {
        let readings = self.shape.rows * self.shape.inputs;
        self.networks.iter().map(|network| network.bytes() + network.front_bytes(readings)).sum()
    }

    /// The network of each row, or all networks if they see whole frames.
    pub fn row_networks(&self) -> impl Iterator<Item = &NetworkDesign> {
        self.row_network.iter().filter_map(|index| self.networks.get(*index))
    }

    /// Whether networks see whole frames.
    pub fn whole_frames(&self) -> bool {
        self.networks.iter().any(|network| network.front.is_some())
    }
}

impl NetworkDesign {
    /// The design of `network`.
    pub fn new(network: &Network<'_>) -> Self {
        Self {
            format: network.format(),
            shape: network.shape(),
            affine_tail: network.has_affine_tail(),
            front: None,
        }
    }

    /// Number of features of its projection; 0 without one.
    pub fn features(&self) -> usize {
        if self.front.is_some_and(|front| front.projection) { self.shape.inputs } else { 0 }
    }

    /// Bytes in a blob of what stands before it.
    fn front_bytes(&self, readings: usize) -> usize {
        let Some(front) = self.front else { return 0 };
        let touch = front.touch.map_or(0, |_| touch::block_floats(readings));
        let features = self.features();
        let projection = if features > 0 { (1 + front.seen(readings)) * features } else { 0 };
        (touch + projection) * size_of::<f32>()
    }

    /// Bytes of the network's parameters in a blob.
    pub fn bytes(&self) -> usize {
        let Self { format, shape, affine_tail, .. } = *self;
        let words = match format {
            Format::F32 => float32::Network::block_words(shape, affine_tail),
            Format::Fixed16 => fixed16::Network::block_words(shape, affine_tail),
        };
        words * size_of::<u32>()
    }
}
