//! Decoding of whole tables on one thread.
//!
//! Readings and estimates are written to cargo's folder for temporary files, for `compare/decode.py`.

use std::fs;
use std::hint::black_box;
use std::path::PathBuf;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use taxel_core::rbf::{Network, Shape, direct, expanded, fixed16};
use taxel_core::scale::{HALF_RANGE, UNITS, UNITS_PER_STEP};
use taxel_data::random::{Purpose, Random, Stream};
use taxel_learn::Exponential;
use taxel_learn::infer::infer;

/// Lines in a table; `compare/decode.py` divides by it.
const LINES: usize = 8192;
const CHANNELS: usize = 18;
const CENTRES: [usize; 2] = [64, 256];
const SPREAD: f64 = 0.8;
const LOWEST_OHM: f64 = 40.0;
const SPAN_OHM: f64 = 20.0;

/// Network by its formula: centres on inputs scaled to [0, 1].
struct Formula {
    shape: Shape,
    centres: Vec<f64>,
    weights: Vec<f64>,
    affine: Vec<f64>,
    bias: Vec<f64>,
}

impl Formula {
    fn random(centres: usize, random: &mut Random) -> Self {
        let mut draw = |count: usize, low: f64, high: f64| -> Vec<f64> {
            (0..count).map(|_| random.between([low, high])).collect()
        };
        Self {
            shape: Shape { inputs: CHANNELS, centres, outputs: CHANNELS },
            centres: draw(centres * CHANNELS, 0.0, 1.0),
            weights: draw(centres * CHANNELS, -1.0, 1.0),
            affine: draw(CHANNELS * CHANNELS, -0.5, 0.5),
            bias: draw(CHANNELS, -1.0, 1.0),
        }
    }

    /// Words of this network with expanded distances.
    fn expanded(&self) -> Vec<u32> {
        let unit = f64::from(HALF_RANGE / UNITS);
        let decay = std::f64::consts::LOG2_E / (2.0 * SPREAD * SPREAD) * unit * unit;
        let mut exponents = Vec::new();
        for centre in self.centres.chunks_exact(CHANNELS) {
            let centre: Vec<f64> = centre.iter().map(|c| (c - 0.5) / unit).collect();
            exponents.push(-(decay * centre.iter().map(|c| c * c).sum::<f64>()) as f32);
            exponents.extend(centre.iter().map(|c| (2.0 * decay * c) as f32));
        }
        let parameters = expanded::Parameters {
            input_midpoint: &[(LOWEST_OHM + 0.5 * SPAN_OHM) as f32; CHANNELS],
            input_per_unit: &[(1.0 / (unit * SPAN_OHM)) as f32; CHANNELS],
            decay: decay as f32,
            bias: &single(&self.bias_about_the_middle()),
            affine: &single(&self.affine.iter().map(|a| a * unit).collect::<Vec<_>>()),
            exponents: &exponents,
            output_weights: &single(&self.weights),
        };
        parameters.words().collect()
    }

    /// Words of this network in fixed point.
    fn fixed16(&self) -> Vec<u32> {
        let Shape { centres, outputs, .. } = self.shape;
        let step = f64::from(HALF_RANGE / UNITS * UNITS_PER_STEP);
        let per_step = std::f64::consts::LOG2_E / (2.0 * SPREAD * SPREAD) * step * step;
        let decay = (per_step * 2_f64.powi(60)).round();
        // No sum exceeds as many ones as there are centres, inputs and biases.
        let scale = (centres + CHANNELS + 1) as f64 / 2_f64.powi(31);
        let integer = |value: f64| value.round() as i16;
        let mut words = Vec::new();
        for first in (0..centres).step_by(fixed16::CENTRES_AT_ONCE) {
            let group = first..first + fixed16::CENTRES_AT_ONCE;
            for k in group.clone() {
                let centre = &self.centres[k * CHANNELS..(k + 1) * CHANNELS];
                let a = centre
                    .iter()
                    .map(|c| integer(-2.0 * decay / 2_f64.powi(34) * (c - 0.5) / step));
                let a: Vec<i16> = a.collect();
                let square: u64 = a.iter().map(|a| u64::from(a.unsigned_abs()).pow(2)).sum();
                words.push((square << 32).div_ceil(decay as u64) as u32 + fixed16::EXPONENT_MARGIN);
                words.extend_from_slice(bytemuck::cast_slice(&a));
            }
            for output in 0..outputs {
                let weight = |k: usize| self.weights[k * CHANNELS + output] / (scale * 32_768.0);
                let weights: Vec<i16> = group.clone().map(|k| integer(weight(k))).collect();
                words.extend_from_slice(bytemuck::cast_slice(&weights));
            }
        }
        let affine = (0..outputs * CHANNELS).map(|at| {
            let (output, input) = (at / CHANNELS, at % CHANNELS);
            integer(self.affine[input * CHANNELS + output] * step / scale)
        });
        let affine: Vec<i16> = affine.collect();
        let bias = self.bias_about_the_middle();
        let parameters = fixed16::Parameters {
            input_midpoint: &[(LOWEST_OHM + 0.5 * SPAN_OHM) as f32; CHANNELS],
            input_per_unit: &[(f64::from(UNITS / HALF_RANGE) / SPAN_OHM) as f32; CHANNELS],
            decay: decay as u32,
            bias: &bias.iter().map(|b| (b / scale).round() as i32).collect::<Vec<_>>(),
            output_scale: &[scale as f32; CHANNELS],
            affine: bytemuck::cast_slice(&affine),
            centres: &words,
        };
        parameters.words().collect()
    }

    /// Bias for a tail on inputs about the middle.
    fn bias_about_the_middle(&self) -> Vec<f64> {
        let mut bias = self.bias.clone();
        for row in self.affine.chunks_exact(CHANNELS) {
            bias.iter_mut().zip(row).for_each(|(bias, a)| *bias += 0.5 * a);
        }
        bias
    }

    /// Words of this network with direct distances.
    fn direct(&self) -> Vec<u32> {
        let parameters = direct::Parameters {
            input_minimum: &[LOWEST_OHM as f32; CHANNELS],
            input_per_span: &[(1.0 / SPAN_OHM) as f32; CHANNELS],
            centres: &single(&self.centres),
            decay: &[(0.5 / (SPREAD * SPREAD)) as f32],
            output_weights: &single(&self.weights),
            bias: &single(&self.bias),
            affine: &single(&self.affine),
        };
        parameters.words().collect()
    }
}

fn single(values: &[f64]) -> Vec<f32> {
    values.iter().map(|value| *value as f32).collect()
}

fn leave(name: &str, values: &[f64]) {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("decode-{name}.f64"));
    let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    fs::write(path, bytes).expect("a writable folder for temporary files");
}

fn decode(criterion: &mut Criterion) {
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let mut random = Random::new(1, Stream::Test, Purpose::Centres, 0, 0);
    let (low, high) = (LOWEST_OHM, LOWEST_OHM + SPAN_OHM);
    let readings: Vec<f64> = (0..LINES * CHANNELS).map(|_| random.between([low, high])).collect();
    leave("readings", &readings);

    let mut group = criterion.benchmark_group("decode");
    group.sample_size(30).throughput(Throughput::Elements(LINES as u64));
    for centres in CENTRES {
        let formula = Formula::random(centres, &mut random);
        let (expanded, direct, fixed) = (formula.expanded(), formula.direct(), formula.fixed16());
        let shape = formula.shape;
        let networks: [Network<'_>; 3] = [
            expanded::Network::try_new(shape, true, &expanded).expect("sound parameters").into(),
            direct::Network::of_words(shape, true, true, &direct).expect("sound parameters").into(),
            fixed16::Network::try_new(shape, true, &fixed).expect("sound parameters").into(),
        ];
        for network in networks {
            let name = network.format().name();
            let exponential = Exponential::Polynomial;
            leave(&format!("{name}-{centres}"), &infer(&network, exponential, &readings));
            group.bench_function(BenchmarkId::new(name, centres), |bencher| {
                one_thread.install(|| {
                    bencher.iter(|| infer(&network, exponential, black_box(&readings)));
                });
            });
        }
        leave(&format!("centres-{centres}"), &formula.centres);
        leave(&format!("weights-{centres}"), &formula.weights);
        leave(&format!("affine-{centres}"), &formula.affine);
        leave(&format!("bias-{centres}"), &formula.bias);
    }
    group.finish();
}

criterion_group!(benches, decode);
criterion_main!(benches);
