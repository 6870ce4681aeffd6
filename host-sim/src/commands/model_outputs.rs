//! Outputs of a model, with the errors that it had in training.

use serde::Serialize;
use taxel_core::blob::Model;

/// Output of a model.
#[derive(Serialize)]
pub struct ModelOutput {
    pub name: String,
    pub unit: String,
    /// RMSE on the training frames, in the unit.
    pub training_rmse: f32,
    /// Full scale, in the unit.
    pub full_scale: f32,
}

/// All outputs of `model`, in their order.
pub fn of(model: &Model<'_>) -> Vec<ModelOutput> {
    let metadata = model.metadata();
    let errors = metadata.training_rmse.iter().zip(metadata.full_scale.iter());
    let outputs = metadata.output_names.iter().zip(metadata.output_units.iter()).zip(errors);
    outputs
        .map(|((name, unit), (training_rmse, full_scale))| ModelOutput {
            name: name.into(),
            unit: unit.into(),
            training_rmse,
            full_scale,
        })
        .collect()
}
