//! A block of frames, one frame a lane: drawn, computed, disturbed, and laid out frame after frame.

#![allow(clippy::needless_range_loop, reason = "lanes of several arrays are indexed alike")]

use std::f64::consts::TAU;

use crate::elementary::{exp, is_near_an_axis, sin_cos};
use crate::random::{Purpose, RandomBlock, Stream};
use crate::scene::{Deformation, Quantity, Scene};
use crate::sensor::{BlockModel, Scratch, Vector3};
use crate::simd::{self, LANES, Lanes};

/// What all blocks of a synthesis share.
pub(super) struct Synthesis<'s> {
    scene: &'s Scene,
    stream: Stream,
    model: BlockModel<'s>,
    /// Span of every channel that is read, in Ω; empty for relative noise.
    span_ohm: Vec<f64>,
    /// Place of each output of a row among electrodes and axes, and what its deformation is multiplied by.
    outputs: Vec<(usize, f64)>,
}

/// Memory that blocks of one thread use one after the other.
pub(super) struct Workspace {
    /// By electrode of a row, and axis.
    deformation_mm: Vec<[Lanes; 3]>,
    /// By column-wire.
    resistance_ohm: Vec<Lanes>,
    scratch: Scratch,
}

/// One contact a frame, pressed into the face.
struct Contact {
    centre_mm: [Lanes; 2],
    dent_radius_mm: Lanes,
    dent_depth_mm: Lanes,
    /// Δx/Δz and Δy/Δz.
    shear: [Lanes; 2],
}

impl<'s> Synthesis<'s> {
    /// Prepares frames of `stream`, with noise by `span_ohm` where that is not empty.
    pub(super) fn new(scene: &'s Scene, stream: Stream, span_ohm: Vec<f64>) -> Self {
        let factor = |axis: usize| match scene.outputs.quantity {
            Quantity::Deformation => 1.0,
            Quantity::Force => scene.sensor.stiffness_n_per_mm[axis],
        };
        let of_an_electrode = |electrode: usize| {
            let axes = scene.outputs.axes.iter().map(|axis| axis.index());
            axes.map(move |axis| (3 * electrode + axis, factor(axis)))
        };
        let outputs = (0..scene.sensor.electrodes_per_row_wire).flat_map(of_an_electrode);
        let model = BlockModel::new(&scene.sensor);
        Self { scene, stream, model, span_ohm, outputs: outputs.collect() }
    }

    /// Memory for one thread.
    pub(super) fn workspace(&self) -> Workspace {
        let sensor = &self.scene.sensor;
        Workspace {
            deformation_mm: vec![[[0.0; LANES]; 3]; sensor.electrodes_per_row_wire],
            resistance_ohm: vec![[0.0; LANES]; sensor.column_wires],
            scratch: Scratch::default(),
        }
    }

    /// Fills `readings` and `outputs` with the frames from number `first` on; at most [`LANES`].
    pub(super) fn fill(
        &self,
        workspace: &mut Workspace,
        first: usize,
        readings: &mut [f64],
        outputs: &mut [f64],
    ) {
        simd::widest(
            #[inline(always)]
            || self.fill_in_lanes(workspace, first, readings, outputs),
        );
    }

    #[inline(always)]
    fn draw_contact(&self, random: &mut RandomBlock) -> Option<Contact> {
        let Deformation::Press { dent_radius_mm, dent_depth_mm, shear_ratio } =
            self.scene.deformation
        else {
            return None;
        };
        random.start(self.scene.seed, self.stream, Purpose::Contact, 0);
        let size_mm = &self.scene.sensor.size_mm;
        Some(Contact::draw(random, size_mm, [dent_radius_mm, dent_depth_mm, shear_ratio]))
    }

    #[inline(always)]
    fn draw_deformation(
        &self,
        row: usize,
        random: &mut RandomBlock,
        contact: Option<&Contact>,
        deformation_mm: &mut [[Lanes; 3]],
    ) {
        match (contact, self.scene.deformation) {
            (Some(contact), _) => {
                let electrodes = self.scene.sensor.row_electrodes_mm(row);
                for (delta, electrode) in deformation_mm.iter_mut().zip(electrodes) {
                    contact.deform(electrode, delta);
                }
            }
            (None, Deformation::Independent { dx_mm, dy_mm, dz_mm }) => {
                random.start(self.scene.seed, self.stream, Purpose::Deformation, row as u64);
                for delta in deformation_mm {
                    random.between([dx_mm, dy_mm, dz_mm], delta);
                }
            }
            (None, Deformation::Press { .. }) => unreachable!("a press has a contact"),
        }
    }

    #[inline(always)]
    fn disturb(
        &self,
        (place, row): (usize, usize),
        random: &mut RandomBlock,
        resistance_ohm: &mut [Lanes],
    ) {
        let (level, columns) = (self.scene.noise.level, self.scene.sensor.column_wires);
        if level == 0.0 {
            return;
        }
        random.start(self.scene.seed, self.stream, Purpose::Noise, row as u64);
        let mut normals = [[0.0; LANES]; 2];
        for (pair, readings) in resistance_ohm.chunks_mut(2).enumerate() {
            let [even, odd] = &mut normals;
            random.normal_pair(even, odd);
            for (side, (readings, normals)) in readings.iter_mut().zip(&normals).enumerate() {
                let span = self.span_ohm.get(place * columns + 2 * pair + side);
                for (reading, normal) in readings.iter_mut().zip(normals) {
                    *reading += level * span.unwrap_or(reading) * normal;
                }
            }
        }
    }

    /// [`fill`](Self::fill), to be inlined into [`simd::widest`].
    #[inline(always)]
    fn fill_in_lanes(
        &self,
        workspace: &mut Workspace,
        first: usize,
        readings: &mut [f64],
        outputs: &mut [f64],
    ) {
        let scene = self.scene;
        let (rows, columns) = (scene.read_rows.len(), scene.sensor.column_wires);
        let Workspace { deformation_mm, resistance_ohm, scratch } = workspace;
        let mut random = RandomBlock::new(first);
        let contact = self.draw_contact(&mut random);
        for (place, &row) in scene.read_rows.iter().enumerate() {
            self.draw_deformation(row, &mut random, contact.as_ref(), deformation_mm);
            let model = &self.model;
            let precision = scene.precision;
            model.row_column_resistance_ohm(
                row,
                precision,
                deformation_mm,
                scratch,
                resistance_ohm,
            );
            self.disturb((place, row), &mut random, resistance_ohm);
            let row_of_frames = readings.chunks_exact_mut(columns).skip(place).step_by(rows);
            for (frame, readings) in row_of_frames.enumerate() {
                for (place, lanes) in readings.iter_mut().zip(&*resistance_ohm) {
                    *place = lanes[frame];
                }
            }
            let (width, lanes) = (self.outputs.len(), deformation_mm.as_flattened());
            let row_of_frames = outputs.chunks_exact_mut(width).skip(place).step_by(rows);
            for (frame, outputs) in row_of_frames.enumerate() {
                for (output, (place, factor)) in outputs.iter_mut().zip(&self.outputs) {
                    *output = factor * lanes[*place][frame];
                }
            }
        }
    }
}

impl Contact {
    /// Draws a contact a frame: its centre uniform over the face, and `[radius, depth, shear ratio]`.
    #[inline(always)]
    fn draw(
        random: &mut RandomBlock,
        size_mm: &Vector3,
        [dent_radius_mm, dent_depth_mm, shear_ratio]: [[f64; 2]; 3],
    ) -> Self {
        let ranges = [
            [0.0, size_mm[0]],
            [0.0, size_mm[1]],
            dent_radius_mm,
            dent_depth_mm,
            shear_ratio,
            [0.0, 1.0],
        ];
        let mut drawn = [[0.0; LANES]; 6];
        random.between(ranges, &mut drawn);
        let [x_mm, y_mm, dent_radius_mm, dent_depth_mm, ratios, turns] = drawn;
        let mut shear = [[0.0; LANES]; 2];
        for frame in 0..LANES {
            let angle_rad = TAU * turns[frame];
            let (sine, cosine) = if is_near_an_axis(turns[frame]) {
                (libm::sin(angle_rad), libm::cos(angle_rad))
            } else {
                sin_cos(angle_rad)
            };
            shear[0][frame] = ratios[frame] * cosine;
            shear[1][frame] = ratios[frame] * sine;
        }
        Self { centre_mm: [x_mm, y_mm], dent_radius_mm, dent_depth_mm, shear }
    }

    #[inline(always)]
    fn deform(&self, electrode_mm: &Vector3, [dx_mm, dy_mm, dz_mm]: &mut [Lanes; 3]) {
        let mut exponents = [0.0; LANES];
        let mut lowest = 0.0_f64;
        for frame in 0..LANES {
            let x = electrode_mm[0] - self.centre_mm[0][frame];
            let y = electrode_mm[1] - self.centre_mm[1][frame];
            let radius = self.dent_radius_mm[frame];
            exponents[frame] = -(x * x + y * y) / (2.0 * radius * radius);
        }
        for frame in 0..LANES {
            dz_mm[frame] = self.dent_depth_mm[frame] * exp(exponents[frame]);
        }
        for exponent in exponents {
            lowest = if exponent < lowest { exponent } else { lowest };
        }
        if lowest < -700.0 {
            for frame in (0..LANES).filter(|frame| exponents[*frame] < -700.0) {
                dz_mm[frame] = self.dent_depth_mm[frame] * libm::exp(exponents[frame]);
            }
        }
        for frame in 0..LANES {
            dx_mm[frame] = self.shear[0][frame] * dz_mm[frame];
            dy_mm[frame] = self.shear[1][frame] * dz_mm[frame];
        }
    }
}
