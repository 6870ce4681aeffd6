//! Inference of networks in f32 with expanded distances, several lines side by side: the bits of
//! [`taxel_core::rbf::expanded`], several times as fast.

use taxel_core::exp::exp2;
use taxel_core::rbf::expanded::{self, Parameters};
use taxel_core::rbf::{Network, Shape};
use taxel_core::scale::clamp_units;

use super::{read, write};

/// Lines side by side.
const LANES: usize = 8;

type Lanes = [f32; LANES];

/// Infers the outputs of `network` for the lines of these numbers, as [`super::infer_lines`] does.
#[inline(always)]
pub(super) fn infer_lines(
    network: expanded::Network<'_>,
    numbers: impl Iterator<Item = usize>,
    readings: &[f64],
    values: &mut [f64],
) {
    let Shape { inputs, outputs, .. } = network.shape();
    let (p, network) = (network.parameters(), Network::from(network));
    let (mut line, mut scaled_line) = (vec![0.0; inputs], vec![0.0; inputs]);
    let (mut scaled, mut inferred) = (vec![[0.0; LANES]; inputs], vec![[0.0; LANES]; outputs]);
    let numbers: Vec<usize> = numbers.collect();
    for numbers in numbers.chunks(LANES) {
        let mut is_whole = [false; LANES];
        for (l, number) in numbers.iter().enumerate() {
            is_whole[l] = read(&readings[number * inputs..], &mut line);
            network.scale(&line, &mut scaled_line).expect("lengths of the network");
            scaled.iter_mut().zip(&scaled_line).for_each(|(lanes, x)| lanes[l] = *x);
        }
        infer(&p, &mut scaled, &mut inferred);
        for (l, number) in numbers.iter().enumerate() {
            let of_line = inferred.iter().map(|lanes| lanes[l]);
            write(of_line, is_whole[l], &mut values[number * outputs..]);
        }
    }
}

/// Infers `outputs` from `scaled` inputs, which are overwritten.
#[inline(always)]
fn infer(p: &Parameters<'_>, scaled: &mut [Lanes], outputs: &mut [Lanes]) {
    for x in scaled.iter_mut() {
        *x = x.map(clamp_units);
    }
    outputs.fill([0.0; LANES]);
    for (x, row) in scaled.iter().zip(p.affine.chunks_exact(outputs.len())) {
        accumulate(outputs, x, row);
    }
    let mut sums = [[0.0; LANES]; 4];
    for (i, x) in scaled.iter().enumerate() {
        add_products(&mut sums[i % 4], x, x);
    }
    let shared = total(&sums).map(|square| -(p.decay * square));
    let rows = p.exponents.chunks_exact(1 + scaled.len());
    for (row, weights) in rows.zip(p.output_weights.chunks_exact(outputs.len())) {
        let mut sums = [[row[0]; LANES], shared, [0.0; LANES], [0.0; LANES]];
        for (i, (x, a)) in scaled.iter().zip(&row[1..]).enumerate() {
            add_products(&mut sums[i % 4], x, &[*a; LANES]);
        }
        accumulate(outputs, &total(&sums).map(exp2), weights);
    }
    for (y, bias) in outputs.iter_mut().zip(p.bias) {
        *y = y.map(|y| y + bias);
    }
}

#[inline(always)]
fn add_products(sums: &mut Lanes, a: &Lanes, b: &Lanes) {
    for l in 0..LANES {
        sums[l] += a[l] * b[l];
    }
}

#[inline(always)]
fn total(sums: &[Lanes; 4]) -> Lanes {
    std::array::from_fn(|l| (sums[0][l] + sums[1][l]) + (sums[2][l] + sums[3][l]))
}

#[inline(always)]
fn accumulate(outputs: &mut [Lanes], factor: &Lanes, weights: &[f32]) {
    for (y, weight) in outputs.iter_mut().zip(weights) {
        add_products(y, factor, &[*weight; LANES]);
    }
}
