//! Products of pairs of 16-bit integers on lines side by side.
//!
//! x86-64 multiplies two pairs and adds both products in one instruction, which no compiler finds by itself.

#![cfg_attr(
    target_arch = "x86_64",
    expect(unsafe_code, reason = "calls for machines that have these vectors")
)]

use taxel_data::simd::LANES;

use super::column::Column;

/// Adds to each sum the products of the pairs `x` with those of its row of `weights`, modulo 2³². A pair is a word of two
/// `i16`. Rows are of equal length; only the last words of each, one for each of `x`, are weights.
pub fn add_products(x: &[Column<u32>], weights: &[u32], sums: &mut [Column<i32>]) {
    #[cfg(target_arch = "x86_64")]
    if std::is_x86_feature_detected!("avx512bw") {
        if std::is_x86_feature_detected!("avx512vnni") {
            // SAFETY: this machine has these parts of AVX-512, the second of which includes the first.
            return unsafe { x86::with_vnni(x, weights, sums) };
        }
        // SAFETY: this machine has this part of AVX-512.
        return unsafe { x86::with_avx512(x, weights, sums) };
    }
    #[cfg(target_arch = "x86_64")]
    if std::is_x86_feature_detected!("avx2") {
        // SAFETY: this machine has AVX2.
        return unsafe { x86::with_avx2(x, weights, sums) };
    }
    add_products_portably(x, weights, sums);
}

/// Adds products as [`add_products`] does, on any machine.
pub fn add_products_portably(x: &[Column<u32>], weights: &[u32], sums: &mut [Column<i32>]) {
    let halves = |pair: u32| [i32::from(pair as i16), i32::from((pair >> 16) as i16)];
    let rows = rows(weights, sums.len(), x.len());
    for (sum, row) in sums.iter_mut().zip(rows) {
        for (x, weights) in x.iter().zip(row) {
            let [low, high] = halves(*weights);
            for (sum, x) in sum.0.iter_mut().zip(x.0) {
                let [x_low, x_high] = halves(x);
                *sum = sum.wrapping_add(x_low * low).wrapping_add(x_high * high);
            }
        }
    }
}

/// The last `pairs` words of so many rows of `weights`.
#[inline(always)]
fn rows(weights: &[u32], count: usize, pairs: usize) -> impl Iterator<Item = &[u32]> {
    let length = weights.len() / count;
    weights.chunks_exact(length).map(move |row| &row[length - pairs..])
}

/// Products by the vector instructions of x86-64, each function for machines that have them.
#[cfg(target_arch = "x86_64")]
pub mod x86 {
    use std::arch::x86_64::{
        __m256i, __m512i, _mm256_add_epi32, _mm256_madd_epi16, _mm256_set1_epi32, _mm512_add_epi32,
        _mm512_madd_epi16, _mm512_set1_epi32,
    };

    use super::{Column, LANES, rows};

    /// Number of sums that are held in registers.
    const AT_ONCE: usize = 8;

    /// Functions that add products, to all sums and to a few, with some machines' vectors. They have no closures, which are
    /// not inlined where functions have instructions of their own.
    macro_rules! add_products {
        ($name:ident, $to_few:ident, $features:literal, $vector:ty, $splat:ident, $multiply:ident, $add:ident) => {
            /// Adds products as [`add_products`](super::add_products) does.
            ///
            /// # Safety
            /// The machine has these vectors.
            #[target_feature(enable = $features)]
            pub fn $name(x: &[Column<u32>], weights: &[u32], sums: &mut [Column<i32>]) {
                let mut rows = rows(weights, sums.len(), x.len());
                let (tiles, rest) = sums.as_chunks_mut::<AT_ONCE>();
                for sums in tiles {
                    let mut of_sums = [&weights[..0]; AT_ONCE];
                    for (place, row) in of_sums.iter_mut().zip(&mut rows) {
                        *place = row;
                    }
                    $to_few(x, of_sums, sums);
                }
                for (sum, row) in rest.iter_mut().zip(rows) {
                    $to_few(x, [row], std::array::from_mut(sum));
                }
            }

            #[target_feature(enable = $features)]
            fn $to_few<const N: usize>(
                x: &[Column<u32>],
                rows: [&[u32]; N],
                sums: &mut [Column<i32>; N],
            ) {
                for vector in 0..size_of::<[i32; LANES]>() / size_of::<$vector>() {
                    let mut of_vector = [$splat(0); N];
                    for (register, sum) in of_vector.iter_mut().zip(&*sums) {
                        let vectors = std::ptr::from_ref(sum).cast::<$vector>();
                        // SAFETY: a column has so many vectors, and is aligned to them.
                        *register = unsafe { *vectors.add(vector) };
                    }
                    for (pair, x) in x.iter().enumerate() {
                        let vectors = std::ptr::from_ref(x).cast::<$vector>();
                        // SAFETY: as above.
                        let x = unsafe { *vectors.add(vector) };
                        for (register, row) in of_vector.iter_mut().zip(&rows) {
                            let weights = $splat(row[pair].cast_signed());
                            *register = $add(*register, $multiply(x, weights));
                        }
                    }
                    for (register, sum) in of_vector.iter().zip(&mut *sums) {
                        let vectors = std::ptr::from_mut(sum).cast::<$vector>();
                        // SAFETY: as above.
                        unsafe { *vectors.add(vector) = *register };
                    }
                }
            }
        };
    }

    // With VNNI, the compiler joins multiplication and addition.
    add_products!(
        with_vnni,
        to_few_with_vnni,
        "avx512bw,avx512vnni",
        __m512i,
        _mm512_set1_epi32,
        _mm512_madd_epi16,
        _mm512_add_epi32
    );
    add_products!(
        with_avx512,
        to_few_with_avx512,
        "avx512bw",
        __m512i,
        _mm512_set1_epi32,
        _mm512_madd_epi16,
        _mm512_add_epi32
    );
    add_products!(
        with_avx2,
        to_few_with_avx2,
        "avx2",
        __m256i,
        _mm256_set1_epi32,
        _mm256_madd_epi16,
        _mm256_add_epi32
    );
}
