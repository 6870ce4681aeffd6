//! Computations whose results must be the same on host and target, to the last bit, as lines of a log.
//! `firmware/tests/bit_for_bit.rs` compiles this file for the host, and compares its lines with those of the target.

use core::fmt::Arguments;

use crc::{CRC_32_ISO_HDLC, Crc, Digest, Table};
use taxel_core::blob::Model;
use taxel_core::filter::{Settings, State};
use taxel_core::rbf::{Format, Network};
use taxel_core::reading_model::{ReadingModel, Sizes};
use taxel_core::scale::{CLAMP, saturates};
use taxel_core::{Decoder, Estimate, RowStatus};

/// Number of row-wires, as in the paper's sensor.
pub const ROWS: usize = 8;
/// Number of column-wires, as in the paper's sensor.
pub const COLS: usize = 18;
/// Number of outputs a row.
pub const OUTPUTS: usize = 18;
/// Number of row-wires of a small sensor that one network decodes, behind a projection.
pub const ARRAY_ROWS: usize = 2;

const FRAMES: usize = 6;
const CRC: Crc<u32, Table<0>> = Crc::<u32, Table<0>>::new(&CRC_32_ISO_HDLC);

/// Generator of pseudo-random numbers in [−1, 1), the same on every platform: the upper bits of a linear
/// congruential generator (Knuth's MMIX).
pub struct Numbers(u64);

impl Numbers {
    /// Starts a generator with this `seed`.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Draws the next number.
    pub fn draw(&mut self) -> f32 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 40) as i32 - (1 << 23)) as f32 / (1 << 23) as f32
    }
}

fn add(digest: &mut Digest<'_, u32, Table<0>>, values: &[f32]) {
    values.iter().for_each(|value| digest.update(&value.to_bits().to_le_bytes()));
}

/// Readings of `R` rows in Ω.
pub type Frame<const R: usize> = [[f32; COLS]; R];

/// What a decoder makes of a frame of `R` rows.
#[derive(Clone, Copy)]
struct Decoded<const R: usize> {
    outputs: [[f32; OUTPUTS]; R],
    status: [RowStatus; R],
    /// Whether an input was clamped.
    clamped: bool,
}

impl<const R: usize> Decoded<R> {
    const NOTHING: Self = Self {
        outputs: [[0.0; OUTPUTS]; R],
        status: [RowStatus::MissingReading; R],
        clamped: false,
    };

    /// Decodes `frame` into `self`; `None` if the model has another shape.
    fn decode(&mut self, decoder: &Decoder<'_, R>, frame: &Frame<R>) -> Option<()> {
        let outputs = self.outputs.as_flattened_mut();
        let mut estimate = Estimate { outputs, status: &mut self.status };
        let mut scratch = [0.0; 2 * COLS + ARRAY_ROWS * COLS + 1];
        let frame = frame.as_flattened().into();
        self.clamped = decoder.decode_into(frame, &mut scratch, &mut estimate).ok()?;
        Some(())
    }

    /// What `decoder` makes of `frame`.
    fn new(decoder: &Decoder<'_, R>, frame: &Frame<R>) -> Option<Self> {
        let mut outcome = Self::NOTHING;
        outcome.decode(decoder, frame)?;
        Some(outcome)
    }
}

/// CRC-32 of all bits that the model in `blob` decodes some frames to, one with a missing reading. `None` if the
/// blob does not load.
pub fn decoding(blob: &[u8]) -> Option<u32> {
    let decoder = Decoder::<ROWS>::load(blob).ok()?;
    let crc = CRC;
    let mut digest = crc.digest();
    let mut numbers = Numbers::new(1);
    let mut outcome = Decoded::NOTHING;
    for frame in 0..FRAMES {
        let mut readings: Frame<ROWS> = [[f32::NAN; COLS]; ROWS];
        let places = readings.as_flattened_mut().iter_mut();
        places.for_each(|ohm| *ohm = 60.0 + 5.0 * numbers.draw());
        if frame == 1 {
            readings[2][3] = f32::NAN;
        }
        outcome.decode(&decoder, &readings)?;
        add(&mut digest, outcome.outputs.as_flattened());
    }
    Some(digest.finalize())
}

/// Number of frames that every number format decodes.
const MANY: usize = 10_000;

/// CRC-32 with a table, for many bytes.
pub const QUICK_CRC: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);

/// Largest distances in Ω of readings from the middle of the training range, one for each frame in turn: within
/// the range, beyond it, far beyond the clamp, below zero, and up to the largest numbers.
const REACHES: [f32; 8] = [5.0, 5.0, 5.0, 7.0, 9.0, 30.0, 1e3, 3e38];

/// Frame number `index` of many, with some readings missing or infinite.
pub fn one_of_many<const R: usize>(index: usize, numbers: &mut Numbers) -> Frame<R> {
    let mut frame = [[f32::NAN; COLS]; R];
    let readings = frame.as_flattened_mut();
    let reach = REACHES[index % REACHES.len()];
    readings.iter_mut().for_each(|ohm| *ohm = 60.0 + reach * numbers.draw());
    let none = [f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
    if let (0, Some(reading)) = (index % 50, readings.get_mut(index / 50 % (R * COLS))) {
        *reading = none[index / 50 % none.len()];
    }
    frame
}

/// Readings that no sensor gives: the ends of f32, subnormal numbers, and zeros.
const EXTREMES: [f32; 10] =
    [f32::MAX, f32::MIN, 1e30, -1e30, f32::MIN_POSITIVE, 1e-39, -1e-39, 1e-45, 0.0, -0.0];

/// Frame number `index` of those with [`EXTREMES`] among readings around the training range.
fn one_of_extremes<const R: usize>(index: usize, numbers: &mut Numbers) -> Frame<R> {
    let mut frame = one_of_many(index, numbers);
    for reading in frame.as_flattened_mut() {
        let place = (8.0 * (numbers.draw() + 1.0)) as usize;
        *reading = EXTREMES.get(place).copied().unwrap_or(*reading);
    }
    frame
}

/// CRC-32 of all bits that the model in `blob` decodes so many `frames` to, and of whether an input was clamped.
#[inline(never)] // as all that follows, so that the stack holds one decoder at a time
fn decoding_all<const R: usize>(
    blob: &[u8],
    frames: usize,
    frame: fn(usize, &mut Numbers) -> Frame<R>,
) -> Option<u32> {
    let decoder = Decoder::<R>::load(blob).ok()?;
    let crc = QUICK_CRC;
    let mut digest = crc.digest();
    let mut numbers = Numbers::new(4);
    let mut outcome = Decoded::NOTHING;
    for index in 0..frames {
        outcome.decode(&decoder, &frame(index, &mut numbers))?;
        for (outputs, status) in outcome.outputs.iter().zip(outcome.status) {
            outputs.iter().for_each(|value| digest.update(&value.to_bits().to_le_bytes()));
            digest.update(&[status as u8]);
        }
        digest.update(&[u8::from(outcome.clamped)]);
    }
    Some(digest.finalize())
}

/// Number of frames with one reading within four steps of f32 of an end of the clamp, how many of them are said to be
/// clamped, and how many otherwise than by portable arithmetic. `None` if the blob does not load, or is in `f32`, which
/// clamps before it infers.
#[inline(never)]
fn clamping(blob: &[u8]) -> Option<[usize; 3]> {
    let decoder = Decoder::<ROWS>::load(blob).ok()?;
    let model = Model::decode(blob).ok()?;
    let network_of = |row| model.networks().nth(model.network_of_row(row)?);
    let mut middle: Frame<ROWS> = [[f32::NAN; COLS]; ROWS];
    for (row, readings) in middle.iter_mut().enumerate() {
        let network = network_of(row)?;
        for (input, reading) in readings.iter_mut().enumerate() {
            let [low, high] = network.training_range(input);
            *reading = 0.5 * (low + high);
        }
    }
    let [mut frames, mut clamped, mut otherwise] = [0; 3];
    for row in 0..ROWS {
        let network = network_of(row)?;
        if matches!(network, Network::F32(_)) {
            return None;
        }
        for (input, (end, step)) in (0..COLS)
            .flat_map(|input| CLAMP.map(|end| (input, end)))
            .flat_map(|(input, end)| (-4..=4).map(move |step| (input, (end, step))))
        {
            let [low, high] = network.training_range(input);
            let reading = low + end * (high - low);
            let mut frame = middle;
            *frame.get_mut(row)?.get_mut(input)? =
                f32::from_bits(reading.to_bits().wrapping_add_signed(step));
            let mut scaled = [0.0; COLS];
            network.clamps(frame.get(row)?, &mut scaled).ok()?;
            let found = Decoded::new(&decoder, &frame)?.clamped;
            frames += 1;
            clamped += usize::from(found);
            otherwise += usize::from(found != scaled.into_iter().any(saturates));
        }
    }
    Some([frames, clamped, otherwise])
}

/// Sizes of the reading model of a model of the small sensor.
pub const ARRAY_READINGS: Sizes = Sizes {
    readings: ARRAY_ROWS * COLS,
    factors: 10,
    components: 6,
    outputs: ARRAY_ROWS * OUTPUTS,
};

/// Fills `block` with the numbers of a reading model of these `sizes`, for readings about 60 Ω.
pub fn write_reading_model(sizes: Sizes, block: &mut [f32], numbers: &mut Numbers) {
    let Sizes { readings, factors, components, outputs } = sizes;
    let mut places = block.iter_mut();
    let mut put = |count: usize, middle: f32, reach: f32| {
        places.by_ref().take(count).for_each(|place| *place = middle + reach * numbers.draw());
    };
    put(readings, 60.0, 1.0);
    put(readings, 0.2, 0.02);
    put(factors, 0.0, 0.0);
    put(factors * readings, 0.0, 0.28);
    for _ in 0..components {
        put(1, -3.0, 1.0);
        put(sizes.features(), 0.0, 2.0);
        put(sizes.features() * sizes.features(), 0.0, 0.3);
    }
    put(components * outputs, 1.0, 0.9);
    put(outputs, 2.0, 0.5);
    put(1, 20.0, 0.0);
}

/// CRC-32 of all bits of the novelty and the deviations of frames, and of what is filled of them, and how many frames are
/// novel, how many of these too far off to tell, and how many have no novelty.
struct Assessed {
    crc: u32,
    novel: usize,
    far: usize,
    missing: usize,
}

impl Assessed {
    /// Counts a frame of this `novelty`.
    fn count(&mut self, novelty: f32) {
        self.novel += usize::from(novelty > 0.0);
        self.far += usize::from(novelty >= f32::MAX);
        self.missing += usize::from(novelty.is_nan());
    }

    const NONE: Self = Self { crc: 0, novel: 0, far: 0, missing: 0 };
}

/// What [`MANY`] frames are by the reading model in `blob`, with some readings filled. `None` if the blob does not load, or has none.
#[inline(never)]
fn assessing_many(blob: &[u8]) -> Option<Assessed> {
    let decoder = Decoder::<ARRAY_ROWS>::load(blob).ok()?;
    let crc = QUICK_CRC;
    let (mut digest, mut assessed) = (crc.digest(), Assessed::NONE);
    let mut numbers = Numbers::new(4);
    let mut scratch = [0.0; ARRAY_READINGS.scratch_floats()];
    for index in 0..MANY {
        let mut frame = one_of_many::<ARRAY_ROWS>(index, &mut numbers);
        let frame = frame.as_flattened_mut();
        let mut deviation = [0.0; ARRAY_READINGS.outputs];
        let given = (&*frame).into();
        let novelty = decoder.assess_into(given, &mut scratch, &mut deviation).ok()??;
        for place in frame.iter_mut().skip(index % 7).step_by(5 + index % 4).take(index % 3) {
            *place = f32::NAN;
        }
        decoder.fill(frame, &[], &mut scratch);
        for value in deviation.into_iter().chain([novelty]).chain(frame.iter().copied()) {
            digest.update(&value.to_bits().to_le_bytes());
        }
        assessed.count(novelty);
    }
    Some(Assessed { crc: digest.finalize(), ..assessed })
}

/// Most factors of the reading models that [`assessing_sizes`] makes.
const MOST_FACTORS: usize = 12;
/// Sizes of these reading models.
const fn few_outputs(factors: usize) -> Sizes {
    Sizes { readings: COLS, factors, components: 5, outputs: 7 }
}

/// What frames of one row are by reading models of 1 to 12 factors. `None` if one is unsound.
#[inline(never)]
fn assessing_sizes() -> Option<Assessed> {
    let crc = QUICK_CRC;
    let (mut digest, mut assessed) = (crc.digest(), Assessed::NONE);
    let mut numbers = Numbers::new(7);
    for factors in 1..=MOST_FACTORS {
        let sizes = few_outputs(factors);
        let mut block = [0.0; few_outputs(MOST_FACTORS).block_floats()];
        let block = block.get_mut(..sizes.block_floats())?;
        write_reading_model(sizes, block, &mut numbers);
        let model = ReadingModel::new(sizes, block).ok()?;
        let mut scratch = [0.0; few_outputs(MOST_FACTORS).scratch_floats()];
        for index in 0..MANY / 20 {
            let [row] = one_of_many::<1>(index, &mut numbers);
            let mut deviation = [0.0; few_outputs(1).outputs];
            let novelty = model.assess(&row, None, &mut scratch, &mut deviation).ok()??;
            for value in deviation.into_iter().chain([novelty]) {
                digest.update(&value.to_bits().to_le_bytes());
            }
            assessed.count(novelty);
        }
    }
    Some(Assessed { crc: digest.finalize(), ..assessed })
}

/// Where lines of a log go.
pub type Say<'s> = &'s mut dyn FnMut(Arguments<'_>);

/// The models of the paper's shape, by format.
const KERNELS: [(Format, &str); 2] =
    [(Format::F32, "kernels-f32.bin"), (Format::Fixed16, "kernels-fixed16.bin")];

/// The models of networks that see whole frames.
const ARRAYS: [(&str, &str); 4] = [
    ("f32", "array-f32.bin"),
    ("fixed16", "array-fixed16.bin"),
    ("fixed16 without tail", "array-fixed16-no-tail.bin"),
    ("touch", "array-touch.bin"),
];

/// Says what every number format decodes of [`MANY`] frames, what a clamp finds, and what frames
/// are by a reading model. `None` if one of the models in testdata, which `model` gives by name, does not load.
pub fn kernels<'m>(model: &dyn Fn(&str) -> &'m [u8], say: Say<'_>) -> Option<()> {
    for (format, file) in KERNELS {
        let crc = decoding_all::<ROWS>(model(file), MANY, one_of_many)?;
        say(format_args!("{}: {crc:08x}", format.name()));
    }
    let [frames, clamped, otherwise] = clamping(model("kernels-fixed16.bin"))?;
    say(format_args!(
        "clamp, fixed16: {clamped} of {frames} frames clamped, {otherwise} otherwise than the twin's"
    ));
    for (name, file) in ARRAYS {
        let crc = decoding_all::<ARRAY_ROWS>(model(file), MANY, one_of_many)?;
        say(format_args!("array, {name}: {crc:08x}"));
    }
    let many = assessing_many(model("array-fixed16-confidence.bin"))?;
    for (what, assessed) in [("assess_into", many), ("1 to 12 factors", assessing_sizes()?)] {
        let Assessed { crc, novel, far, missing } = assessed;
        say(format_args!(
            "reading model, {what}: {crc:08x}, {novel} frames novel, {far} of them far, {missing} missing"
        ));
    }
    let (crc, started) = filtering();
    say(format_args!("filter: {crc:08x}, started anew {started} times"));
    Some(())
}

/// CRC-32 of all bits of outputs that a filter in time gives, and how often it starts anew: frames are late, missed and
/// repeated; rows are faulty; the settings are drawn now and then.
fn filtering() -> (u32, usize) {
    const OUTPUTS: usize = 3;
    let (crc, mut numbers) = (CRC, Numbers::new(7));
    let mut digest = crc.digest();
    let mut draw = |most: f32| (most * (1.0 + numbers.draw()) / 2.0) as u32;
    let mut state = State::new([[0.0; 2]; ROWS * OUTPUTS]);
    let mut settings = Settings::default();
    let (mut start_us, mut started) = (1 << 40, 0);
    for frame in 0..MANY {
        if frame % 50 == 0 {
            settings = Settings { time_constant_us: 1 + draw(2e4), lead_us: draw(1e4) };
        }
        let step_us = [1000, 1000 + draw(200.0), 4000, 0, draw(3e5)][draw(4.1) as usize];
        start_us += u64::from(step_us);
        started += usize::from(step_us > 10 * settings.time_constant_us);
        let mut outputs = [[0.0; OUTPUTS]; ROWS];
        let mut status = [RowStatus::Decoded; ROWS];
        for (outputs, status) in outputs.iter_mut().zip(&mut status) {
            outputs.fill_with(|| draw(2e6) as f32 * 1e-6 - 1.0);
            if draw(30.0) == 1 {
                *status = RowStatus::MissingReading;
                outputs.fill(f32::NAN);
            }
        }
        let outputs = outputs.as_flattened_mut();
        let mut estimate = Estimate { outputs, status: &mut status };
        state.filter(settings, start_us, &mut estimate);
        add(&mut digest, outputs);
    }
    (digest.finalize(), started)
}

/// Says what every number format decodes of readings that no sensor gives, while subnormals are treated as `mode` says.
pub fn extremes<'m>(mode: &str, model: &dyn Fn(&str) -> &'m [u8], say: Say<'_>) -> Option<()> {
    say(format_args!("subnormals {mode}"));
    for (format, file) in KERNELS {
        let crc = decoding_all::<ROWS>(model(file), MANY / 10, one_of_extremes)?;
        say(format_args!("{}: {crc:08x}", format.name()));
    }
    Some(())
}
