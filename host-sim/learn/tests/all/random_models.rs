//! Tables decoded on the host against frames decoded by the device's code, bit for bit, for models of random numbers.

use taxel_core::blob::{Front, Metadata, ModelParts, ModelShape, encode_to_vec};
use taxel_core::projection::Projection;
use taxel_core::rbf::{Format, Network, Shape, fixed16, float32};
use taxel_core::relative::reciprocal;
use taxel_core::scale::{HALF_RANGE, UNITS};
use taxel_core::touch::{Kind, Touch};
use taxel_core::{Decoder, Frame};
use taxel_data::Stream;
use taxel_data::random::{Purpose, Random};
use taxel_learn::ModelBlob;

/// Range of readings: that of training, which is about [0, 1], and what is clamped.
const READINGS: [f64; 2] = [-0.3, 1.3];

struct Draw(Random);

impl Draw {
    fn floats(&mut self, count: usize, range: [f64; 2]) -> Vec<f32> {
        (0..count).map(|_| self.0.between(range) as f32).collect()
    }

    /// Words of any bits.
    fn words(&mut self, count: usize) -> Vec<u32> {
        (0..count).map(|_| (self.0.unit() * 4_294_967_296.0) as u32).collect()
    }

    /// A number from 1 to `most`.
    fn size(&mut self, most: usize) -> usize {
        1 + self.0.below(most)
    }

    fn yes(&mut self) -> bool {
        self.0.below(2) == 1
    }

    /// A network whose inputs have a training range of about 1.
    fn network(&mut self, shape: Shape, format: Format) -> Network<'static> {
        let affine = self.yes();
        match format {
            Format::F32 => {
                let words = self.float32(shape, affine).leak();
                float32::Network::of_words(shape, affine, words).unwrap().into()
            }
            Format::Fixed16 => {
                let words = self.fixed16(shape, affine).leak();
                fixed16::Network::try_new(shape, affine, words).unwrap().into()
            }
        }
    }

    fn float32(&mut self, shape: Shape, affine: bool) -> Vec<u32> {
        let Shape { inputs, centres, outputs } = shape;
        // Some outputs overflow.
        let most = if self.0.below(8) == 0 { 3e38 } else { 1e3 };
        let parameters = float32::Parameters {
            input_minimum: &self.floats(inputs, [-0.5, 0.5]),
            input_per_span: &self.floats(inputs, [0.0, 2.0]),
            centres: &self.floats(centres * inputs, [-0.1, 1.1]),
            // Up to where activations vanish.
            decay: &self.floats(centres, [0.01, 40.0]),
            output_weights: &self.floats(centres * outputs, [-most, most]),
            bias: &self.floats(outputs, [-1.0, 1.0]),
            affine: &self.floats(if affine { inputs * outputs } else { 0 }, [-1.0, 1.0]),
        };
        parameters.words().collect()
    }

    /// Words with weights of any bits: sums wrap around, on the host as on the device.
    fn fixed16(&mut self, shape: Shape, affine: bool) -> Vec<u32> {
        let Shape { inputs, centres, outputs } = shape;
        let pairs = inputs.div_ceil(2);
        // Exponents reach up to 4·1.8² for each of up to four inputs, and for all together beyond four.
        let most = f64::from(u32::MAX) * (4.0 / inputs as f64).min(1.0);
        let decay = self.0.between([1.0, most]) as u32;
        let slope = f64::from(decay) / 2_f64.powi(33);
        let mut words = Vec::new();
        for _ in 0..centres.div_ceil(fixed16::CENTRES_AT_ONCE) {
            for _ in 0..fixed16::CENTRES_AT_ONCE {
                let centre = self.floats(inputs, [-26_214.0, 26_214.0]);
                let mut a: Vec<i16> =
                    centre.iter().map(|c| (slope * f64::from(*c)) as i16).collect();
                a.resize(2 * pairs, 0);
                let square: u64 = a.iter().map(|a| u64::from(a.unsigned_abs()).pow(2)).sum();
                let b = (square << 32).div_ceil(u64::from(decay)) as u32;
                words.push(b + fixed16::EXPONENT_MARGIN);
                let word = |[low, high]: &[i16; 2]| {
                    u32::from(low.cast_unsigned()) | u32::from(high.cast_unsigned()) << 16
                };
                words.extend(a.as_chunks::<2>().0.iter().map(word));
            }
            words.extend(self.words(outputs * fixed16::CENTRES_AT_ONCE / 2));
        }
        let bias: Vec<i32> = self.words(outputs).iter().map(|it| it.cast_signed()).collect();
        let parameters = fixed16::Parameters {
            input_midpoint: &self.floats(inputs, [0.0, 1.0]),
            input_per_unit: &self.floats(inputs, [0.0, f64::from(UNITS / HALF_RANGE)]),
            decay,
            bias: &bias,
            output_scale: &self.floats(outputs, [-1e-6, 1e-6]),
            affine: &self.words(if affine { outputs * pairs } else { 0 }),
            centres: &words,
        };
        parameters.words().collect()
    }

    /// What makes inputs of about 1 of so many readings: a touch, a projection, or both.
    fn front(&mut self, readings: usize, outputs: usize) -> Front<'static> {
        let [has_touch, has_projection] = [self.yes(), self.yes()];
        let touch = has_touch.then(|| {
            let (kind, side) = ([Kind::Place, Kind::Amount][self.0.below(2)], self.0.below(3));
            let [least, most] = [0.4, 0.45].map(|it| it * readings as f32);
            let mut block = vec![1e-3, 1e-3, least, most];
            block.push(side as f32 - 1.0);
            for _ in 0..readings {
                block.extend(self.floats(1, READINGS));
                block.push(self.floats(1, [0.0, 0.1])[0] * self.0.below(2) as f32);
            }
            Touch::new(kind, block.leak()).unwrap()
        });
        let inputs = readings + usize::from(has_touch);
        let projection = has_projection.then(|| {
            let (features, size) = (self.size(20), if has_touch { 1.0 } else { 0.2 });
            let block = self.floats((1 + inputs) * features, [-size, size]).leak();
            Projection::new(inputs, features, block).unwrap()
        });
        Front { outputs, touch, projection }
    }

    fn reading(&mut self) -> f64 {
        match self.0.below(600) {
            0 => f64::NAN,
            1 => f64::NEG_INFINITY,
            2 => 1e300, // beyond f32
            3 => -3e38,
            4 => 3e38,
            5 => self.0.between([-1e6, 1e6]),
            _ => self.0.between(READINGS),
        }
    }

    /// Baselines of so many readings: about 1, and some that are missing.
    fn baseline(&mut self, readings: usize) -> Vec<f64> {
        // A third of all baselines lack a level.
        let one_in = 6 * readings;
        let mut level = || match self.0.below(one_in) {
            0 => f64::NAN,
            1 => 0.0,
            _ => self.0.between([0.7, 1.4]),
        };
        (0..readings).map(|_| level()).collect()
    }
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

/// Compares the tables of a model of `networks`, of readings or of their ratios to a baseline, with frames that the
/// device's code decodes. Returns how many outputs are numbers, and how many are NaN.
fn compare(
    draw: &mut Draw,
    fronts: &[Front<'_>],
    networks: &[Network<'_>],
    shape: ModelShape,
) -> [usize; 2] {
    let row_network: Vec<u8> = (0..shape.rows).map(|row| row as u8).collect();
    let relative_inputs = draw.yes();
    let metadata = Metadata { relative_inputs, ..Metadata::unnamed(shape) };
    let parts = ModelParts { fronts, ..ModelParts::new(networks, &row_network, metadata) };
    let blob = ModelBlob::of_bytes(&encode_to_vec(&parts).unwrap()).unwrap();
    let decoder = Decoder::<4>::load(blob.bytes()).unwrap();
    let (width, frames) = (shape.rows * shape.inputs, draw.0.below(200));
    let readings: Vec<f64> = (0..frames * width).map(|_| draw.reading()).collect();
    let baseline = draw.baseline(width);
    let reciprocals: Vec<f32> = baseline.iter().map(|ohm| reciprocal(*ohm as f32)).collect();
    let prepared = blob.prepare().with_baseline(&baseline);
    let tables = prepared.decode_lines(&readings);
    // The same ratios, computed outside.
    let ratios = prepared.model_inputs(&readings);
    let of_ratios = prepared.clone().of_inputs();
    assert_eq!(bits(&of_ratios.decode_lines(&ratios)), bits(&tables));
    assert_eq!(of_ratios.share_out_of_range(&ratios), prepared.share_out_of_range(&readings));
    let mut counts = [0; 2];
    let lines = tables.chunks_exact(shape.rows * shape.outputs);
    assert_eq!(lines.len(), frames);
    for (readings, outputs) in readings.chunks_exact(width).zip(lines) {
        let line: Vec<f32> = readings.iter().map(|reading| *reading as f32).collect();
        let frame = Frame { readings_ohm: &line, reciprocals: &reciprocals };
        let expected = decoder.decode(frame).unwrap().outputs;
        let alone = prepared.decode_lines(readings);
        for (found, expected) in outputs.iter().chain(&alone).zip(expected.iter().chain(&expected))
        {
            let is_same = found.to_bits() == f64::from(*expected).to_bits();
            assert!(is_same || found.is_nan() && expected.is_nan(), "{found} {expected} {shape:?}");
            counts[usize::from(expected.is_nan())] += 1;
        }
    }
    counts
}

fn check(seed: u64, model: impl Fn(&mut Draw, Format) -> [usize; 2]) {
    let mut draw = Draw(Random::new(seed, Stream::Test, Purpose::Noise, 0, 0));
    for format in Format::ALL {
        let mut counts = [0; 2];
        for _ in 0..60 {
            counts.iter_mut().zip(model(&mut draw, format)).for_each(|(sum, it)| *sum += it);
        }
        assert!(counts.iter().all(|count| *count > 1000), "{format:?}: {counts:?}");
    }
}

#[test]
fn tables_of_row_networks_are_decoded_as_on_a_device() {
    check(1, |draw, format| {
        let [inputs, centres, outputs] = [draw.size(40), draw.size(70), draw.size(20)];
        let shape = ModelShape { rows: draw.size(4), inputs, outputs };
        let of_row = |_| draw.network(Shape { inputs, centres, outputs }, format);
        let networks: Vec<Network<'_>> = (0..shape.rows).map(of_row).collect();
        compare(draw, &[], &networks, shape)
    });
}

#[test]
fn tables_of_frame_networks_are_decoded_as_on_a_device() {
    check(2, |draw, format| {
        let (readings, parts) = (draw.size(150), draw.size(3));
        let (mut fronts, mut networks) = (vec![], vec![]);
        for _ in 0..parts {
            let outputs = draw.size(30);
            let front = draw.front(readings, outputs);
            let shape = Shape { inputs: front.inputs(readings), centres: draw.size(70), outputs };
            networks.push(draw.network(shape, format));
            fronts.push(front);
        }
        let outputs = fronts.iter().map(|front| front.outputs).sum();
        compare(draw, &fronts, &networks, ModelShape { rows: 1, inputs: readings, outputs })
    });
}
