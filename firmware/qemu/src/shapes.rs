//! Networks and projections of many shapes, by assembly and by its compiled twins.
//!
//! What assembly reads lies directly before a place where reads fault. What it writes is followed by numbers that
//! must stay.

use core::{ptr, slice};

use cortex_m::peripheral::MPU;

use taxel_core::projection::Projection;
use taxel_core::rbf::{Network, Shape, fixed16};
use taxel_core::scale::UNITS;
use taxel_core::touch::{Kind, Touch};

use crate::checks::Numbers;

/// End of the parameters, in the machine's PSRAM; what lies behind must not be read.
const END: usize = 0x21FF_0000;
/// Number of words before the end that are used.
const WORDS: usize = 0x4_0000;
/// Most inputs, and most outputs, of a shape.
const MOST: usize = 160;
/// Number of readings beyond the most, which must stay what they are.
const BEYOND: usize = 4;
/// A NaN that no computation makes.
const UNTOUCHED: u32 = 0x7FC1_2345;
/// Middle of all training ranges, in Ω.
const MIDDLE_OHM: f32 = 60.0;
/// Largest distances in Ω of readings from the middle, one for each inference of a network.
const REACHES_OHM: [f32; 4] = [5.0, 9.0, 300.0, 3e38];

/// Numbers of networks or the like that were compared, and of those that differ.
#[derive(Debug, Clone, Copy, Default)]
pub struct Comparison {
    /// How many were compared.
    pub compared: usize,
    /// How many differ from the twin in some bit, or write beyond their outputs.
    pub different: usize,
}

impl Comparison {
    fn add(&mut self, same: bool) {
        self.compared += 1;
        self.different += usize::from(!same);
    }
}

/// Memory for parameters, behind which reads fault, and for what is computed.
pub struct Memory {
    words: &'static mut [u32],
    buffers: [Guarded; 3],
}

/// A buffer of which some first numbers are written, and those behind must stay.
struct Guarded(&'static mut [f32]);

impl Memory {
    /// Takes the memory, and protects the 64 KiB behind the parameters.
    ///
    /// # Safety
    /// The caller must ensure that this is called only once, and that nothing else uses the PSRAM or the MPU.
    pub unsafe fn take(mpu: &MPU) -> Self {
        const SIZE_64_KIB_NO_ACCESS: u32 = 15 << 1 | 1;
        const ENABLE_WITH_DEFAULT_MAP: u32 = 1 << 2 | 1;
        // SAFETY: the region holds nothing that is used.
        unsafe {
            mpu.rnr.write(0);
            mpu.rbar.write(END as u32);
            mpu.rasr.write(SIZE_64_KIB_NO_ACCESS);
            mpu.ctrl.write(ENABLE_WITH_DEFAULT_MAP);
        }
        cortex_m::asm::dsb();
        cortex_m::asm::isb();
        let start = END - WORDS * 4;
        let at = ptr::with_exposed_provenance_mut(start);
        // SAFETY: the memory is there, of this size, aligned, and any bits are numbers. Nothing else uses it.
        let words = unsafe { slice::from_raw_parts_mut(at, WORDS) };
        let buffers = [1, 2, 3].map(|number| {
            let at = ptr::with_exposed_provenance_mut(start - number * (MOST + BEYOND) * 4);
            // SAFETY: as above; the buffers lie before the words, one before the other.
            Guarded(unsafe { slice::from_raw_parts_mut(at, MOST + BEYOND) })
        });
        Self { words, buffers }
    }
}

/// The last `count` words.
fn last(words: &mut [u32], count: usize) -> &mut [u32] {
    let first = words.len().saturating_sub(count);
    words.get_mut(first..).unwrap_or_default()
}

impl Guarded {
    fn first(&mut self, count: usize) -> &mut [f32] {
        self.0.get_mut(..count).unwrap_or_default()
    }

    /// Fills the whole buffer with what must stay.
    fn guard(&mut self) {
        self.0.fill(f32::from_bits(UNTOUCHED));
    }

    fn is_untouched_from(&self, count: usize) -> bool {
        self.0.iter().skip(count).all(|value| value.to_bits() == UNTOUCHED)
    }
}

fn same_bits(a: &[f32], b: &[f32]) -> bool {
    a.iter().map(|value| value.to_bits()).eq(b.iter().map(|value| value.to_bits()))
}

/// Shapes to compare: all small numbers of inputs and outputs, some large ones, and every remainder of centres.
fn shapes() -> impl Iterator<Item = Shape> {
    let all = (1..=40).flat_map(|inputs| {
        [1, 4, 5, 6, 12, 18, 41 - inputs].map(|outputs| Shape { inputs, centres: 20, outputs })
    });
    let outputs = (1..=40).map(|outputs| Shape { inputs: 7, centres: 16, outputs });
    let large = [1, 15, 16, 17, 128, 129, 257].into_iter().flat_map(|centres| {
        let sizes = [(18, 18), (18, 6), (18, 36), (12, 5), (1, 1), (24, 3), (32, 24), (144, 6)];
        sizes.map(|(inputs, outputs)| Shape { inputs, centres, outputs })
    });
    let wide = [17, 63, 64, 127, 128, 144, 160]
        .into_iter()
        .flat_map(|inputs| [1, 19, 144].map(|outputs| Shape { inputs, centres: 5, outputs }));
    all.chain(outputs).chain(large).chain(wide)
}

/// Writes a network of `shape` with random numbers in the format's own ranges to `words`.
fn write_network(words: &mut [u32], shape: Shape, affine: bool, numbers: &mut Numbers) {
    let Shape { inputs, centres, outputs } = shape;
    let mut words = words.iter_mut();
    let mut put = |count: usize, next: &mut dyn FnMut() -> u32| {
        words.by_ref().take(count).for_each(|word| *word = next());
    };
    let any = |numbers: &mut Numbers| ((numbers.draw() * UNITS) as i32).cast_unsigned();
    put(inputs, &mut || MIDDLE_OHM.to_bits());
    put(inputs, &mut || ((0.12 + 0.02 * numbers.draw()) * UNITS).to_bits());
    // Exponents below 2 for the distance, and as much for a·x.
    let decay = 8_589_934_592.0 / inputs.max(4) as f32;
    put(1, &mut || (decay as i32).cast_unsigned());
    put(outputs, &mut || any(numbers));
    put(outputs, &mut || (1e-6 * numbers.draw()).to_bits());
    let pairs = inputs.div_ceil(2);
    put(if affine { pairs * outputs } else { 0 }, &mut || any(numbers));
    let most = decay / 17_179_869_184.0 * 32_768.0;
    for _ in 0..centres.div_ceil(fixed16::CENTRES_AT_ONCE) {
        for _ in 0..fixed16::CENTRES_AT_ONCE {
            put(1, &mut || ((1_610_612_736.0 + 5e8 * numbers.draw()) as i32).cast_unsigned());
            let mut half = || u32::from(((most * numbers.draw()) as i16).cast_unsigned());
            put(pairs, &mut || half() | half() << 16);
        }
        put(outputs * fixed16::CENTRES_AT_ONCE / 2, &mut || any(numbers));
    }
}

/// Whether assembly infers the same as the twin, from readings and from scaled inputs.
fn is_as_its_twin(
    twin: &fixed16::Network<'_>,
    [scaled, found, expected]: &mut [Guarded; 3],
    numbers: &mut Numbers,
) -> Option<bool> {
    let network = Network::from(*twin);
    let Shape { inputs, outputs, .. } = network.shape();
    let mut same = true;
    for reach in REACHES_OHM {
        let mut readings = [0.0; MOST];
        readings.fill_with(|| MIDDLE_OHM + reach * numbers.draw());
        let readings = readings.get(..inputs)?;
        scaled.guard();
        found.guard();
        network.clamps(readings, scaled.first(inputs)).ok()?;
        twin.infer_scaled_portably(scaled.first(inputs), expected.first(outputs));
        for from_readings in [true, false] {
            found.first(outputs).fill(f32::NAN);
            if from_readings {
                network.infer(readings, scaled.first(inputs), found.first(outputs)).ok()?;
            } else {
                network.clamps(readings, scaled.first(inputs)).ok()?;
                network.infer_scaled(scaled.first(inputs), found.first(outputs)).ok()?;
            }
            same &= same_bits(found.first(outputs), expected.first(outputs));
            same &= scaled.is_untouched_from(inputs) && found.is_untouched_from(outputs);
        }
    }
    Some(same)
}

/// Compares networks in `fixed16` of every shape, with an affine tail and without. `None` if a network is unsound.
#[inline(never)] // frees the stack that this needs
pub fn networks(memory: &mut Memory) -> Option<Comparison> {
    let mut numbers = Numbers::new(6);
    let mut comparison = Comparison::default();
    for (shape, affine) in shapes().flat_map(|shape| [(shape, false), (shape, true)]) {
        let words = last(memory.words, fixed16::Network::block_words(shape, affine));
        write_network(words, shape, affine, &mut numbers);
        let network = fixed16::Network::try_new(shape, affine, words).ok()?;
        comparison.add(is_as_its_twin(&network, &mut memory.buffers, &mut numbers)?);
    }
    Some(comparison)
}

/// Compares projections of 1 to 40 readings to 1 to 40 features, and of 144 readings. `None` if one is unsound.
#[inline(never)]
pub fn projections(memory: &mut Memory) -> Option<Comparison> {
    let mut numbers = Numbers::new(7);
    let mut comparison = Comparison::default();
    let sizes = (1..=41).flat_map(|readings| (1..=40).map(move |features| (readings, features)));
    for (readings, features) in sizes {
        let readings = if readings == 41 { 144 } else { readings };
        let block = last(memory.words, (1 + readings) * features);
        block.iter_mut().for_each(|word| *word = numbers.draw().to_bits());
        let block = bytemuck::cast_slice(block);
        let projection = Projection::new(readings, features, block).ok()?;
        let mut given = [0.0; MOST];
        given.fill_with(|| MIDDLE_OHM + 5.0 * numbers.draw());
        let given = given.get(..readings)?;
        let [_, found, expected] = &mut memory.buffers;
        found.guard();
        projection.project(given, found.first(features));
        projection.project_portably(given, expected.first(features));
        let same = same_bits(found.first(features), expected.first(features));
        comparison.add(same && found.is_untouched_from(features));
    }
    Some(comparison)
}

/// Compares the shapes of touches of 1 to 160 readings, to either side (with thresholds and without) and to one, of readings
/// as they are and relative to the baseline. `None` if one is unsound.
#[inline(never)]
pub fn touches(memory: &mut Memory) -> Option<Comparison> {
    let mut numbers = Numbers::new(8);
    let mut comparison = Comparison::default();
    let sizes = (1..=MOST).flat_map(|readings| {
        [(-1.0, 1.0), (0.0, 1.0), (1.0, 1.0), (0.0, 0.0)].map(|it| (readings, it))
    });
    for ((readings, (side, threshold)), relative) in sizes.flat_map(|it| [(it, false), (it, true)])
    {
        let block = last(memory.words, 5 + 2 * readings);
        block.iter_mut().for_each(|word| *word = (1.0 + numbers.draw().abs()).to_bits());
        *block.get_mut(4)? = f32::to_bits(side);
        let thresholds = block.iter_mut().skip(6).step_by(2);
        thresholds.for_each(|it| *it = (threshold * f32::from_bits(*it)).to_bits());
        let touch = Touch::new(Kind::Amount, bytemuck::cast_slice(block)).ok()?;
        let mut given = [[0.0; MOST]; 2];
        given.as_flattened_mut().fill_with(|| 1.5 + 3.0 * numbers.draw());
        let [given, reciprocals] = [given[0].get(..readings)?, given[1].get(..readings)?];
        let reciprocals = relative.then_some(reciprocals);
        let [_, found, expected] = &mut memory.buffers;
        found.guard();
        // The logarithm stands behind the shape.
        let strength = touch.apply(given, reciprocals, found.first(readings + 1));
        let shape = expected.first(readings);
        let same = touch.shape_portably(given, reciprocals, shape).to_bits() == strength.to_bits()
            && same_bits(found.first(readings), shape);
        comparison.add(same && found.is_untouched_from(readings + 1));
    }
    Some(comparison)
}
