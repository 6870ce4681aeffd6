//! Anomalies: frames that a model of a world was not trained for, and should find novel.

use rayon::prelude::*;
use taxel_data::normal_share_below;
use taxel_data::random::{Purpose, Random, Stream};
use taxel_data::simd::LANES;

use taxel_simulate::motion::{self, Press};
use taxel_simulate::noise::NoiseKind;
use taxel_simulate::outputs::Outputs;
use taxel_simulate::sensor::Vector3;
use taxel_simulate::synth::Synthesis;
use taxel_simulate::world::World;

/// Most frames that are drawn for each frame with two contacts.
const TRIES: usize = 100;

/// What is wrong with a frame. Which wire it strikes, and where, is drawn for each frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anomaly {
    /// Nothing: a usual frame.
    None,
    /// A row-wire is broken between two of its electrodes: those beyond carry no current.
    BrokenRowWire,
    /// A column-wire is broken between two of its electrodes.
    BrokenColumnWire,
    /// Two neighbouring row-wires touch: the readings of each are those of both in parallel.
    ShortedRowWires,
    /// Two neighbouring column-wires touch.
    ShortedColumnWires,
    /// Two contacts, each drawn as the one of the world's motion, whose deformations add up. Together they are no deeper
    /// than one may be.
    TwoContacts,
}

impl Anomaly {
    /// All anomalies, the usual frame first.
    pub const ALL: [Self; 6] = [
        Self::None,
        Self::BrokenRowWire,
        Self::BrokenColumnWire,
        Self::ShortedRowWires,
        Self::ShortedColumnWires,
        Self::TwoContacts,
    ];

    /// Description in a few words.
    pub fn description(self) -> &'static str {
        match self {
            Self::None => "usual frames",
            Self::BrokenRowWire => "a row-wire broken",
            Self::BrokenColumnWire => "a column-wire broken",
            Self::ShortedRowWires => "two row-wires shorted",
            Self::ShortedColumnWires => "two column-wires shorted",
            Self::TwoContacts => "two contacts",
        }
    }
}

/// Frames with an anomaly.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct AnomalousFrames {
    /// Noisy readings in Ω, `frames × readings`.
    pub readings_ohm: Vec<f64>,
    /// Distance of the two contacts' centres in mm, and the lesser of their depths in mm; none for other anomalies.
    pub contacts_mm: Vec<[f64; 2]>,
}

/// Draws `frames` of `world` with an `anomaly`; `None` if its sensor or motion has none of that kind.
pub fn frames(world: &World, anomaly: Anomaly, frames: usize) -> Option<AnomalousFrames> {
    let sensor = &world.sensor;
    let neighbours = world.read_rows.windows(2).any(|rows| rows[1] == rows[0] + 1);
    let possible = match anomaly {
        Anomaly::BrokenRowWire => sensor.electrodes_per_row_wire > 1,
        Anomaly::BrokenColumnWire => sensor.electrodes_per_column_wire > 1,
        Anomaly::ShortedRowWires => neighbours,
        Anomaly::ShortedColumnWires => sensor.column_wires > 1,
        Anomaly::None | Anomaly::TwoContacts => true,
    };
    if !possible {
        return None;
    }
    let (deformations_mm, contacts_mm) = if anomaly == Anomaly::TwoContacts {
        let motion::Kind::Press(press) = &world.motion else { return None };
        two_contacts(world, press, frames)
    } else {
        let moved = Synthesis::new(world).all_rows().outputs(Outputs::all_deformations());
        let moved = moved.drift(None).ideal().frames(Stream::Anomaly, frames);
        (moved.outputs.values, vec![])
    };
    let of_frame = sensor.upper_electrodes_mm.len() * 3;
    let span_ohm = Synthesis::new(world).noise_span_ohm();
    let readings_ohm = deformations_mm
        .par_chunks_exact(of_frame)
        .enumerate()
        .flat_map_iter(|(index, deformation_mm)| {
            let draws = |part| {
                Random::new(world.seed, Stream::Anomaly, Purpose::Anomaly, index as u64, part)
            };
            let mut conductances = conductances(world, deformation_mm, anomaly, &mut draws(0));
            short(world, anomaly, &mut draws(1), &mut conductances);
            let mut noise = draws(2);
            let noisy = |(channel, conductance): (usize, f64)| {
                let reading = 1.0 / conductance;
                let unit = match world.noise.kind {
                    NoiseKind::Relative => reading,
                    NoiseKind::Span => span_ohm.get(channel).copied().unwrap_or(0.0),
                };
                reading + world.noise.level * unit * noise.normal()
            };
            conductances.into_iter().enumerate().map(noisy).collect::<Vec<_>>()
        })
        .collect();
    Some(AnomalousFrames { readings_ohm, contacts_mm })
}

/// Conductances in 1/Ω between the rows that are read and all columns, with a broken wire if that is the anomaly.
fn conductances(
    world: &World,
    deformation_mm: &[f64],
    anomaly: Anomaly,
    random: &mut Random,
) -> Vec<f64> {
    let sensor = &world.sensor;
    let (per_row, per_column) = (sensor.electrodes_per_row_wire, sensor.electrodes_per_column_wire);
    // Wire, and number of its electrodes that are still connected.
    let mut broken =
        |wires: usize, electrodes: usize| (random.below(wires), 1 + random.below(electrodes - 1));
    let (mut row_left, mut column_left) = ((usize::MAX, 0), (usize::MAX, 0));
    match anomaly {
        Anomaly::BrokenRowWire => {
            let (place, left) = broken(world.read_rows.len(), per_row);
            row_left = (world.read_rows[place], left);
        }
        Anomaly::BrokenColumnWire => column_left = broken(sensor.column_wires, per_column),
        _ => {}
    }
    let left = |wire: usize, (broken, left): (usize, usize), all: usize| {
        if wire == broken { left } else { all }
    };
    let mut conductances = Vec::with_capacity(world.read_rows.len() * sensor.column_wires);
    for &row in &world.read_rows {
        let upper = &sensor.row_electrodes_mm(row)[..left(row, row_left, per_row)];
        let moved = deformation_mm.as_chunks::<3>().0[row * per_row..].iter();
        let moved: Vec<Vector3> = upper
            .iter()
            .zip(moved)
            .map(|(at, by)| [at[0] - by[0], at[1] - by[1], at[2] - by[2]])
            .collect();
        for (column, lower) in sensor.lower_electrodes_mm.chunks_exact(per_column).enumerate() {
            let lower = &lower[..left(column, column_left, per_column)];
            let pairs =
                moved.iter().flat_map(|upper| lower.iter().map(move |lower| (upper, lower)));
            let node = |(a, b): (&Vector3, &Vector3)| {
                let squared: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
                1.0 / (sensor.resistance_ohm_per_mm * squared.sqrt())
            };
            conductances.push(pairs.map(node).sum());
        }
    }
    conductances
}

/// Adds up the conductances of two wires that touch, if that is the anomaly.
fn short(world: &World, anomaly: Anomaly, random: &mut Random, conductances: &mut [f64]) {
    let columns = world.sensor.column_wires;
    match anomaly {
        Anomaly::ShortedRowWires => {
            let rows = &world.read_rows;
            let pairs: Vec<usize> =
                (1..rows.len()).filter(|place| rows[*place] == rows[place - 1] + 1).collect();
            let second = pairs[random.below(pairs.len())] * columns;
            let (first, second) =
                conductances[second - columns..second + columns].split_at_mut(columns);
            for (a, b) in first.iter_mut().zip(second) {
                let both = *a + *b;
                (*a, *b) = (both, both);
            }
        }
        Anomaly::ShortedColumnWires => {
            let first = random.below(columns - 1);
            for row in conductances.chunks_exact_mut(columns) {
                let both = row[first] + row[first + 1];
                row[first..first + 2].fill(both);
            }
        }
        _ => {}
    }
}

/// Deformations in mm of frames with two contacts, `frames × electrodes × 3`, and what is told of the contacts. Fewer
/// frames where two contacts are hardly ever no deeper than one may be.
fn two_contacts(world: &World, press: &Press, frames: usize) -> (Vec<f64>, Vec<[f64; 2]>) {
    let sensor = &world.sensor;
    let [least_mm, most_mm] = press.dent_depth_mm;
    let of_frame = sensor.upper_electrodes_mm.len() * 3;
    let (mut deformations_mm, mut contacts_mm) = (vec![], vec![]);
    for piece in 0..(TRIES * frames.div_ceil(LANES)) as u64 {
        let mut random = Random::new(world.seed, Stream::Anomaly, Purpose::Contact, piece, 0);
        let mut sums = vec![0.0; LANES * of_frame];
        let mut latents = [[[0.0; LANES]; 6]; 2];
        latents.as_flattened_mut().as_flattened_mut().iter_mut().for_each(|l| *l = random.normal());
        for latents in &latents {
            let mut deformation_mm = vec![[[0.0; LANES]; 3]; sensor.electrodes_per_row_wire];
            for row in 0..sensor.row_wires {
                world.motion.place(sensor, row, latents, &mut deformation_mm);
                let first = row * sensor.electrodes_per_row_wire * 3;
                for (place, lanes) in deformation_mm.as_flattened().iter().enumerate() {
                    for (frame, value) in lanes.iter().enumerate() {
                        sums[frame * of_frame + first + place] += value;
                    }
                }
            }
        }
        for (frame, sum) in sums.chunks_exact(of_frame).enumerate() {
            if sum.iter().skip(2).step_by(3).any(|dz_mm| *dz_mm > most_mm) {
                continue;
            }
            if contacts_mm.len() == frames {
                return (deformations_mm, contacts_mm);
            }
            let of =
                |contact: usize, latent: usize| normal_share_below(latents[contact][latent][frame]);
            let apart = |axis: usize| sensor.size_mm[axis] * (of(0, axis) - of(1, axis));
            let depth = |contact: usize| least_mm + (most_mm - least_mm) * of(contact, 3);
            deformations_mm.extend_from_slice(sum);
            contacts_mm.push([apart(0).hypot(apart(1)), depth(0).min(depth(1))]);
        }
    }
    (deformations_mm, contacts_mm)
}

#[cfg(test)]
mod tests {
    use super::*;
    use taxel_simulate::noise::Noise;

    fn ideal() -> World {
        let noise = Noise::white(NoiseKind::Relative, 0.0);
        World { noise, ..World::press() }
    }

    fn readings(anomaly: Anomaly) -> Vec<f64> {
        frames(&ideal(), anomaly, 40).unwrap().readings_ohm
    }

    #[test]
    fn usual_frames_are_those_of_synthesis() {
        let synthesised = Synthesis::new(&ideal()).frames(Stream::Anomaly, 40).inputs.values;
        for (found, of) in readings(Anomaly::None).iter().zip(synthesised) {
            assert!((found / of - 1.0).abs() < 1e-12, "{found} {of}");
        }
    }

    #[test]
    fn two_contacts_are_no_deeper_than_one_may_be_and_lie_where_they_say() {
        let drawn = frames(&World::press(), Anomaly::TwoContacts, 500).unwrap();
        assert_eq!((drawn.contacts_mm.len(), drawn.readings_ohm.len()), (500, 500 * 144));
        let farthest_mm = 20.0_f64.hypot(18.0);
        for [apart_mm, depth_mm] in &drawn.contacts_mm {
            assert!((0.0..farthest_mm).contains(apart_mm) && (0.0..=1.0).contains(depth_mm));
        }
        // Uniform centres are 9.9 mm apart on average; the lesser depth of frames that are let through is below ⅓.
        let mean = |of: usize| drawn.contacts_mm.iter().map(|c| c[of]).sum::<f64>() / 500.0;
        assert!(
            (mean(0) - 10.2).abs() < 1.0 && (0.2..0.34).contains(&mean(1)),
            "{} {}",
            mean(0),
            mean(1)
        );
        let press = motion::Kind::from(Press {
            dent_radius_mm: [2.0, 5.0],
            dent_depth_mm: [0.9, 1.0],
            shear_ratio: [0.0, 0.1],
        });
        let deep = frames(&World::of_motion(press), Anomaly::TwoContacts, 500).unwrap();
        assert!(deep.contacts_mm.iter().all(|[_, depth_mm]| *depth_mm >= 0.9));
        assert!(frames(&World::paper(), Anomaly::TwoContacts, 5).is_none());
    }
}
