//! Frames that points are trained and judged on, with one number of samples a reading.

use std::borrow::Cow;

use taxel_data::Silent;
use taxel_data::dataset::Dataset;
use taxel_learn::Options;
use taxel_learn::train::projection::features_at_most;
use taxel_learn::train::{Solver, Start};
use taxel_simulate::Synthesis;
use taxel_simulate::noise::Noise;
use taxel_simulate::outputs::Outputs;

use super::Plan;
use super::device::Wires;
use super::touches::Touches;
use super::worst::OtherContacts;
use crate::error::Result;
use crate::subject::Subject;
use crate::training_set::TrainingSet;

/// Training and test frames with one number of samples a reading, and what is trained on them.
pub(super) struct Frames<'s> {
    pub samples_averaged: usize,
    /// Noise of the averaged readings; `None` for measured ones.
    pub noise: Option<Noise>,
    /// Wires that a scan reads; `None` if the readings are not those of wires.
    pub wires: Option<Wires>,
    /// Time of a scan; `None` if it is unknown.
    pub scan_ms: Option<f64>,
    pub set: TrainingSet<'s>,
    /// Moving contacts that points are judged by; `None` for still frames.
    pub touches: Option<Touches<'s>>,
    /// Contacts that models are not trained on.
    pub others: OtherContacts,
    pub test: Cow<'s, Dataset>,
    /// Networks that see a row each, and networks that see the whole array.
    pub inputs: Vec<Inputs>,
}

/// What networks see of a frame.
pub(super) struct Inputs {
    /// Options for training these networks, but for their number of centres.
    pub options: Options,
    /// What training of each network, or of all networks of rows, starts from.
    pub starts: Vec<Start>,
}

impl Inputs {
    /// Whether each row has a network of its own.
    pub fn each_row(&self) -> bool {
        self.options.each_row
    }
}

impl<'s> Frames<'s> {
    /// Noise level of the averaged readings, as a fraction; 0 for measured ones.
    pub fn noise_level(&self) -> f64 {
        self.noise.as_ref().map_or(0.0, Noise::total_level)
    }

    /// Frames of a subject with so many samples a reading, and the networks that a plan tries on them.
    pub fn new(
        subject: &'s Subject,
        samples_averaged: usize,
        plan: &Plan,
        group: &str,
    ) -> Result<Self> {
        // One network for each row, and one for the array of several rows; that alone where outputs belong to no row.
        let (of_array, wires) = match subject {
            Subject::Scene(scene) => {
                let world = &scene.world;
                (matches!(world.outputs, Outputs::Contact(_)), Some(Wires::of(world)))
            }
            Subject::Measured(data) => (false, Wires::named(&data.training.inputs.names)),
        };
        let noise = subject
            .scene()
            .map(|scene| plan.device.averaged(scene.world.noise, wires, samples_averaged));
        let (mut set, test) = subject.sets(noise);
        set.origin.linear_rmse = set.linear_rmse();
        let touches = subject.scene().and_then(|scene| {
            let synthesis = Synthesis::new(&scene.world).noise(noise?);
            let passes = plan.device.passes(samples_averaged);
            Some(Touches::new(scene, synthesis, (scene.world.path?, passes), group))
        });
        // The paper's own way is none that a device would choose.
        let own = subject.options();
        let mut options = Options { affine_tail: true, solver: Solver::Qr, or_f32: false, ..own };
        if subject.scene().is_some_and(|scene| scene.world.sensor.read_columns.is_some()) {
            // A choice of fewer columns has fewer features: as many as there are.
            let possible = |wanted| features_at_most(&set.frames, wanted).max(1);
            options.features = options.features.map(possible);
        }
        let each_row: &[bool] = match (of_array, set.frames.rows) {
            (true, _) | (false, 1) => &[false],
            (false, _) => &[true, false],
        };
        let inputs = |&each_row: &bool| {
            let mut options = options.for_each_row(each_row);
            let _ = set.choose(&mut options, &Silent);
            Ok(Inputs { options, starts: Start::all(&set.frames, &options)? })
        };
        let inputs = each_row.iter().map(inputs).collect::<Result<_>>()?;
        let scan_ms = plan.device.scan_ms(wires, samples_averaged);
        Ok(Self {
            samples_averaged,
            noise,
            wires,
            scan_ms,
            set,
            touches,
            others: OtherContacts::new(subject, noise, group),
            test,
            inputs,
        })
    }

    /// Frames to train on.
    pub fn training(&self) -> &Dataset {
        &self.set.frames
    }
}
