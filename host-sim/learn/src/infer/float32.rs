//! Inference of a network in f32 on lines side by side: operations and their order are those of
//! [`taxel_core::rbf::float32`].

use taxel_core::exp::exp;
use taxel_core::rbf::float32::Network;
use taxel_core::scale::scale;
use taxel_data::simd::LANES;

use super::column::Column;

/// Centres whose activations are held at a time, and terms that an output takes at a time.
const AT_ONCE: usize = 8;

/// Infers columns of outputs from columns of readings, which become scaled inputs.
#[inline(always)]
pub(super) fn infer(network: &Network<'_>, readings: &mut [Column], outputs: &mut [Column]) {
    let p = network.parameters();
    let limits = p.input_minimum.iter().zip(p.input_per_span);
    for (x, (minimum, per_span)) in readings.iter_mut().zip(limits) {
        for x in &mut x.0 {
            *x = scale(*x, *minimum, *per_span);
        }
    }
    let x = &*readings;
    outputs.iter_mut().for_each(|y| y.0.fill(0.0));
    if !p.affine.is_empty() {
        add_terms(x, p.affine, outputs);
    }
    let mut sums = [Column([0.0; LANES]); 4];
    let mut activations = [Column([0.0; LANES]); AT_ONCE];
    let centres = p.centres.chunks(AT_ONCE * x.len()).zip(p.decay.chunks(AT_ONCE));
    let weights = p.output_weights.chunks(AT_ONCE * outputs.len());
    for ((centres, decays), weights) in centres.zip(weights) {
        let activations = &mut activations[..decays.len()];
        for (centre, distance) in centres.chunks_exact(x.len()).zip(&mut *activations) {
            measure(x, centre, &mut sums, distance);
        }
        // Apart, because each exponential is one long chain of operations: many of them fill the time of one.
        for (activation, decay) in activations.iter_mut().zip(decays) {
            for activation in &mut activation.0 {
                *activation = exp(-decay * *activation);
            }
        }
        add_terms(activations, weights, outputs);
    }
    for (y, bias) in outputs.iter_mut().zip(p.bias) {
        for y in &mut y.0 {
            *y += bias;
        }
    }
}

/// Squared distance of inputs `x` to a centre. Squares accumulate in four interleaved sums, added pairwise; these are zeros
/// before and after.
#[inline(always)]
fn measure(x: &[Column], centre: &[f32], sums: &mut [Column; 4], distance: &mut Column) {
    let (x8, x) = x.as_chunks::<8>();
    let (centre8, centre) = centre.as_chunks::<8>();
    for (x, centre) in x8.iter().zip(centre8) {
        add_squares(x, centre, sums);
    }
    let (x4, x) = x.as_chunks::<4>();
    let (centre4, centre) = centre.as_chunks::<4>();
    for (x, centre) in x4.iter().zip(centre4) {
        add_squares(x, centre, sums);
    }
    for ((x, centre), sum) in x.iter().zip(centre).zip(&mut *sums) {
        for (x, sum) in x.0.iter().zip(&mut sum.0) {
            let d = x - centre;
            *sum += d * d;
        }
    }
    for (lane, distance) in distance.0.iter_mut().enumerate() {
        let [a, b, c, d] = sums.each_mut().map(|sum| std::mem::take(&mut sum.0[lane]));
        *distance = (a + b) + (c + d);
    }
}

/// Adds squared distances of a multiple of four inputs to the four sums.
#[inline(always)]
fn add_squares<const N: usize>(x: &[Column; N], centre: &[f32; N], sums: &mut [Column; 4]) {
    for lane in 0..LANES {
        let mut of_lane = sums.each_ref().map(|sum| sum.0[lane]);
        for (input, (x, centre)) in x.iter().zip(centre).enumerate() {
            let d = x.0[lane] - centre;
            of_lane[input % 4] += d * d;
        }
        sums.iter_mut().zip(of_lane).for_each(|(sum, of_lane)| sum.0[lane] = of_lane);
    }
}

/// Adds `terms` with their `weights` (`terms × outputs`) to the outputs, one term after the other.
#[inline(always)]
pub(super) fn add_terms(terms: &[Column], weights: &[f32], outputs: &mut [Column]) {
    let (whole, rest) = terms.as_chunks::<AT_ONCE>();
    let (of_whole, of_rest) = weights.split_at(whole.len() * AT_ONCE * outputs.len());
    let of_whole = of_whole.chunks_exact(AT_ONCE * outputs.len());
    for (terms, weights) in whole.iter().zip(of_whole) {
        add(terms, weights, outputs);
    }
    let of_rest = of_rest.chunks_exact(outputs.len());
    for (term, weights) in rest.iter().zip(of_rest) {
        add(std::array::from_ref(term), weights, outputs);
    }
}

#[inline(always)]
fn add<const N: usize>(terms: &[Column; N], weights: &[f32], outputs: &mut [Column]) {
    let of_terms: [&[f32]; N] =
        std::array::from_fn(|term| &weights[term * outputs.len()..][..outputs.len()]);
    for (output, y) in outputs.iter_mut().enumerate() {
        let weights = of_terms.map(|of_term| of_term[output]);
        for (lane, y) in y.0.iter_mut().enumerate() {
            for (term, weight) in terms.iter().zip(weights) {
                *y += term.0[lane] * weight;
            }
        }
    }
}
