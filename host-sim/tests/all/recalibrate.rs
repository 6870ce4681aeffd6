//! Recalibration of a device whose sensor has drifted, channel by channel.

use std::time::Duration;

use crate::common::{Folder, unrefined};
use crate::virtual_device::Line;
use host_sim::experiment::Experiment;
use model_core::rbf::Format;
use taxel_data::dataset::Dataset;
use taxel_data::progress::Silent;
use taxel_data::random::{Purpose, Random, Stream};
use taxel_data::table::Table;
use taxel_learn::train::train;
use taxel_learn::{Exponential, ModelBlob, pack};
use taxel_rig::device::recalibrate::recalibrate_from_readings;
use taxel_rig::device::{Device, Wire, upload};
use taxel_rig::emulator::{self, Emulator};
use taxel_simulate::{Synthesis, synthesise};

/// Number of reference presses.
const PRESSES: usize = 200;

/// A scene whose sensor has drifted since its model was trained.
struct Drifted {
    experiment: Experiment,
    /// Factor of each reading: 1 ± 10 %, uniform.
    gains: Vec<f64>,
    model: ModelBlob,
    /// Model of the same kind, trained on the drifted sensor.
    fresh: ModelBlob,
    /// Readings of the drifted sensor, with their outputs: for presses, and then for the test.
    frames: Dataset,
}

impl Drifted {
    fn new(experiment: Experiment, test_frames: usize) -> Self {
        let world = &experiment.world;
        let channels = world.reading_names().len();
        let mut random = Random::new(7, Stream::Test, Purpose::Drift, 0, 0);
        let gains: Vec<f64> = (0..channels).map(|_| random.between([0.9, 1.1])).collect();
        let drifted = |mut dataset: Dataset| {
            for line in dataset.inputs.values.chunks_exact_mut(channels) {
                line.iter_mut().zip(&gains).for_each(|(reading, gain)| *reading *= gain);
            }
            dataset
        };
        let model = experiment.train(&Silent).unwrap();
        let synthesis = Synthesis::of(world);
        let seen = experiment.dataset(&synthesis, Stream::Training, experiment.training.frames);
        let seen = drifted(seen);
        let trained = train(&seen, &experiment.options(), &Silent).unwrap();
        let fresh = pack(&trained, &seen, &experiment.origin()).unwrap();
        let frames = drifted(synthesise(world, Stream::Test, PRESSES + test_frames));
        Self { experiment, gains, model, fresh, frames }
    }

    /// The scene `press`, trained with these changes.
    fn press(test_frames: usize, change: impl FnOnce(&mut Experiment)) -> Self {
        let mut experiment = unrefined("press");
        change(&mut experiment);
        Self::new(experiment, test_frames)
    }

    /// Frames for presses, or those for the test.
    fn part(&self, presses: bool) -> Dataset {
        let all = self.frames.frames();
        let range = if presses { 0..PRESSES } else { PRESSES..all };
        self.frames.subset(&range.collect::<Vec<_>>())
    }

    /// Root mean square error in z of outputs for the test frames, in mm.
    fn z_error(&self, outputs: &[f64]) -> f64 {
        let truth = self.part(false).outputs;
        let columns = truth.names.iter().map(|name| name.ends_with("_dz_mm")).cycle();
        let squares: Vec<f64> = truth
            .values
            .iter()
            .zip(outputs)
            .zip(columns)
            .filter(|(_, is_z)| *is_z)
            .map(|((truth, output), _)| (truth - output).powi(2))
            .collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    }

    /// Errors of the device's model before recalibration and after, and of fresh training, in z.
    fn mend<W: Wire>(&self, device: &mut Device<W>) -> [f64; 3] {
        upload::replace(device, self.model.bytes(), &Silent).unwrap();
        let (presses, test) = (self.part(true), self.part(false));
        let before = self.z_error(&decoded(device, &test.inputs));
        let outcome =
            recalibrate_from_readings(device, &presses.inputs, &presses.outputs, &Silent).unwrap();
        assert_eq!((usize::from(outcome.report.presses), outcome.unusable), (PRESSES, 0));
        assert!(outcome.report.error_after < 0.3 * outcome.report.error_before, "{outcome:?}");
        let mended = decoded(device, &test.inputs);
        let fresh = self.fresh.prepare(Exponential::default()).decode_table(&test.inputs);
        let errors = [before, self.z_error(&mended), self.z_error(&fresh.values)];
        let [before, after, fresh] = errors;
        println!(
            "{}, {} channels: z {before:.4} mm, after {PRESSES} presses {after:.4}, trained afresh {fresh:.4}: {:.3} times",
            self.experiment.training.format.name(),
            self.gains.len(),
            after / fresh
        );
        let memory = device.identify().unwrap().memory;
        println!("stack: {} of {} bytes", memory.stack_high_water, memory.stack_reserved);
        // A virtual device reserves no stack.
        let most = memory.stack_reserved / 4 * 3;
        assert!(most == 0 || memory.stack_high_water <= most, "{memory:?}");
        // A restart keeps the new model; an undo brings the old one back, for good.
        device.restart().unwrap();
        assert_eq!(decoded(device, &test.inputs), mended);
        assert_eq!(device.undo().unwrap(), self.model.parse().crc());
        device.restart().unwrap();
        let active = device.identify().unwrap();
        assert!(active.has_in_force(self.model.parse().crc()));
        assert!(active.is_made_of(&self.model.parse()));
        errors
    }
}

/// What the device decodes `readings` to.
fn decoded<W: Wire>(device: &mut Device<W>, readings: &Table) -> Vec<f64> {
    let values: Vec<f32> = readings.values.iter().map(|reading| *reading as f32).collect();
    let mut outputs = vec![Vec::new(); readings.len()];
    device
        .while_paused(|device| {
            let per_frame = readings.names.len();
            let take = |frame: u32, estimate: &firmware::link::message::EstimateReport<'_>| {
                outputs[frame as usize] = estimate.outputs.iter().map(f64::from).collect();
            };
            taxel_rig::device::stream::decode_frames(device, &values, per_frame, 1, take)
        })
        .unwrap();
    outputs.concat()
}

#[test]
fn presses_mend_the_model_of_a_drifted_sensor() {
    let drifted = Drifted::press(300, |scene| {
        (scene.training.frames, scene.training.centres) = (1000, 16);
    });
    let (host, end) = crate::virtual_device::mailbox::pair();
    crate::virtual_device::run(
        end,
        Line { one_in: None },
        drifted.model.bytes(),
        crate::device::frames(),
    );
    let [before, after, fresh] = drifted.mend(&mut Device::new(host).unwrap());
    assert!(before > 3.0 * fresh && after <= 1.2 * fresh, "{before} {after} {fresh}");
}

/// The image's file comes from the environment, since this needs QEMU and a toolchain for the target.
#[test]
#[ignore = "needs QEMU and the image: `cargo xtask emulate application` runs it"]
fn two_hundred_presses_mend_the_model_of_a_drifted_sensor_in_the_emulator() {
    let image = std::env::var_os("TAXEL_IMAGE").expect("TAXEL_IMAGE is the path of qemu-app");
    let kinds = [(Format::F32, false), (Format::Fixed16, false), (Format::Fixed16, true)];
    for (format, whole_array) in kinds {
        let drifted = Drifted::press(2000, |scene| {
            (scene.training.format, scene.training.whole_array) = (format, whole_array);
        });
        let folder = Folder::new("recalibrated_in_qemu");
        let options = emulator::Options {
            qemu: "qemu-system-arm".into(),
            image: image.clone().into(),
            model: None,
            log: None,
            mailbox: Some(folder.path("mailbox.ram")),
        };
        let (_emulator, link) = Emulator::start(&options).unwrap();
        let mut device = Device::new(link).unwrap();
        device.patience = Duration::from_mins(1);
        let [before, after, fresh] = drifted.mend(&mut device);
        assert!(before > 3.0 * fresh, "the drift must hurt: {before} for {fresh}");
        assert!(after <= 1.1 * fresh, "{format:?}, {whole_array}: {after} for {fresh}");
    }
}
