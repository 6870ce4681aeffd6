//! Flipped bits of the RAM of a device in QEMU, while it decodes.

use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::victim::{COPY, Harm, Victim};
use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;
use crate::tools::{Tools, tested_model};

pub const RAM: Promise = Promise {
    name: "ram-flip",
    text: "flipped RAM bits: 99 % seen, all of the model",
    share: 12,
    check,
};

/// Flips of the short form, and the most.
const LEAST: u64 = 24;
const MOST: u64 = 20_000;
/// Most flips in per cent that no check sees.
const MOST_UNSEEN_PERCENT: f64 = 1.0;

/// The model that is decoded.
const MODEL: &str = "kernels-fixed16.bin";

/// First address and length in bytes of what is flipped: stack, variables, and the copy of the model.
///
/// The addresses are those of the emulator's image. It takes 8.5 KB of variables (`firmware/budget.txt`).
const STACK: (u32, u32) = (0x2000_0000, 8 * 1024);
const VARIABLES: (u32, u32) = (0x2000_2000, 8_500);

fn check(effort: &Effort, tools: &Tools) -> Result<Found, String> {
    let blob = tested_model(MODEL)?;
    let regions =
        [("stack", STACK), ("variables", VARIABLES), ("model", (COPY, blob.len() as u32))];
    let bytes: u32 = regions.iter().map(|(_, (_, length))| length).sum();
    let mut victim = Victim::new(&tools.image("qemu-app")?, &blob)?;
    let mut counts = [0_u64; Harm::ALL.len()];
    let mut flips = 0;
    let mut first_of_model = None;
    while flips < LEAST || (flips < MOST && !effort.is_over()) {
        let seed = effort.seed().wrapping_add(flips);
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut offset = random.next_u32() % bytes;
        let mut region = 0;
        while offset >= regions[region].1.1 {
            offset -= regions[region].1.1;
            region += 1;
        }
        let address = regions[region].1.0 + offset;
        let harm = victim.flip(address, random.next_u32() % 8, &mut random)?;
        counts[harm as usize] += 1;
        flips += 1;
        if harm == Harm::Silent && regions[region].1.0 == COPY {
            first_of_model.get_or_insert((
                seed,
                format!("a flip of the model at {address:#010x} is not seen"),
            ));
        }
    }
    let of = |harm: Harm| counts[harm as usize];
    let unseen = of(Harm::Silent) + of(Harm::ForGood);
    let (share, [low, high]) = share_percent(unseen, flips);
    let note = format!(
        "{} unharmed, {} told, {} faults, {} watchdog, {} mended, {} silent, {} deaf: {share:.2} % ({low:.2}–{high:.2})",
        of(Harm::None),
        of(Harm::Told),
        of(Harm::Fault),
        of(Harm::Watchdog),
        of(Harm::Mended),
        of(Harm::Silent),
        of(Harm::ForGood),
    );
    // A few flips tell no share: it is too large if the whole interval of 95 % is beyond the bound.
    let worst = if first_of_model.is_some() { 100.0 } else { low };
    let (seed, note) = first_of_model.unwrap_or((effort.seed(), note));
    Ok(Found {
        cases: flips,
        refused: 0,
        worst,
        bound: MOST_UNSEEN_PERCENT,
        unit: "% unseen",
        seed,
        note,
    })
}

/// Share in per cent, with Wilson's interval of 95 %.
fn share_percent(count: u64, all: u64) -> (f64, [f64; 2]) {
    let (share, all, z) = (count as f64 / all as f64, all as f64, 1.96);
    let middle = share + z * z / (2.0 * all);
    let half = z * (share * (1.0 - share) / all + z * z / (4.0 * all * all)).sqrt();
    let scale = 100.0 / (1.0 + z * z / all);
    (100.0 * share, [scale * (middle - half), scale * (middle + half)])
}
