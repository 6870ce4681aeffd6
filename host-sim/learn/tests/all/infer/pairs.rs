//! Products of pairs of 16-bit integers, by the instructions of several machines.

#![cfg_attr(
    target_arch = "x86_64",
    expect(unsafe_code, reason = "calls for machines that have these vectors")
)]

use taxel_data::simd::LANES;
use taxel_data::{Purpose, Random, Stream};
use taxel_learn::infer::Column;
#[cfg(target_arch = "x86_64")]
use taxel_learn::infer::pairs::x86;
use taxel_learn::infer::pairs::{add_products, add_products_portably};

/// Adds products of pairs and weights to sums.
type Add = dyn Fn(&[Column<u32>], &[u32], &mut [Column<i32>]);

fn check(add: &Add) {
    let mut random = Random::new(1, Stream::Test, Purpose::Noise, 0, 0);
    let mut word = || (random.unit() * 4_294_967_296.0) as u32;
    for (pairs, before, sums) in [(1, 0, 1), (9, 1, 16), (8, 0, 18), (5, 3, 7), (72, 1, 33)] {
        let x: Vec<_> = (0..pairs).map(|_| Column([(); LANES].map(|()| word()))).collect();
        let weights: Vec<u32> = (0..(before + pairs) * sums).map(|_| word()).collect();
        let starts: Vec<_> =
            (0..sums).map(|_| Column([(); LANES].map(|()| word().cast_signed()))).collect();
        let mut found = starts.clone();
        add(&x, &weights, &mut found);
        for (sum, (found, start)) in found.iter().zip(&starts).enumerate() {
            let row = &weights[sum * (before + pairs) + before..][..pairs];
            for lane in 0..LANES {
                let product = |(x, weight): (&Column<u32>, &u32)| {
                    let x = x.0[lane];
                    let low = i64::from(x as i16) * i64::from(*weight as i16);
                    low + i64::from((x >> 16) as i16) * i64::from((weight >> 16) as i16)
                };
                let all: i64 = x.iter().zip(row).map(product).sum();
                assert_eq!(found.0[lane], (i64::from(start.0[lane]) + all) as i32);
            }
        }
    }
}

#[test]
fn products_are_added_modulo_two_to_the_32_with_any_vectors() {
    check(&add_products);
    check(&add_products_portably);
    #[cfg(target_arch = "x86_64")]
    if std::is_x86_feature_detected!("avx2") {
        // SAFETY: this machine has AVX2.
        check(&|x, weights, sums| unsafe { x86::with_avx2(x, weights, sums) });
    }
    #[cfg(target_arch = "x86_64")]
    if std::is_x86_feature_detected!("avx512bw") {
        // SAFETY: this machine has this part of AVX-512.
        check(&|x, weights, sums| unsafe { x86::with_avx512(x, weights, sums) });
    }
}
