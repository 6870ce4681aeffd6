//! Comparison of a user's own model with the accepted figures of such models.

use super::accepted::OTHER_COMPILERS_PERCENT;
use super::figures::{Figure, Scope};
use super::regions::Count;

/// Largest difference in per cent of cycles, and of instructions of [`DATA_DEPENDENT`] kernels.
const TOLERANCE_PERCENT: u64 = 1;

/// Kernels whose exponentials branch by their arguments: the first one only for activations below e⁻⁸⁷, which
/// occur with narrow widths. All other kernels execute the same instructions for any model and any readings,
/// except those in [`CLAMPING`].
const DATA_DEPENDENT: [&str; 3] = ["f32-direct", "f32-direct-libm", "f32-direct-micromath"];

/// Kernels that look for a missing reading in a row if one is clamped. In the awake frame that can be the reading
/// that touches a row: it is beyond the training range of models that were trained with little noise.
const CLAMPING: [&str; 2] = ["f32", "fixed16"];

/// Largest cost of clamping, for a row.
const CLAMPED_ROW: Count = Count { instructions: 106, cycles: 173 };

/// Number of rows of a frame.
const ROWS: u64 = 8;

/// A figure and the accepted one of the same kernel, K, tail and scope.
pub type Pair<'f> = (&'f Figure, &'f Figure);

/// The figures of `measured` that can be compared, each with the `accepted` one.
///
/// Compiled twins are left out: they search each row's network in the blob for every frame, so that their cost
/// depends on the number of networks.
pub fn of_model<'f>(accepted: &'f [Figure], measured: &'f [Figure]) -> Vec<Pair<'f>> {
    let is_firmwares = |figure: &&Figure| !figure.kernel.ends_with("-portable");
    let pair = |now| Some((now, accepted.iter().find(|then| then.is_of(now))?));
    measured.iter().filter(is_firmwares).filter_map(pair).collect()
}

/// The pairs as lines with aligned columns.
pub fn table(pairs: &[Pair<'_>]) -> String {
    let lines = pairs.iter().map(|(now, then)| {
        format!(
            "{:22} {:4} {:>4} {:19} | {:>12} {:>9} | {:>8} {:>9}\n",
            now.kernel,
            now.centres,
            if now.affine { "yes" } else { "no" },
            now.scope.name(),
            now.count.instructions,
            then.count.instructions,
            now.count.cycles,
            then.count.cycles
        )
    });
    format!(
        "{:22} {:>4} {:>4} {:19} | {:>12} {:>9} | {:>8} {:>9}\n{}",
        "kernel",
        "K",
        "tail",
        "scope",
        "instructions",
        "accepted",
        "cycles",
        "accepted",
        lines.collect::<String>()
    )
}

/// Descriptions of figures that differ by more than the model's numbers explain. With another compiler's figures,
/// only cycles are compared, and fewer are no fault.
pub fn beyond(pairs: &[Pair<'_>], other_compiler: bool) -> Vec<String> {
    let apart = |(now, then): &Pair<'_>| {
        let [mut instructions, mut cycles] = allowances(then);
        if other_compiler {
            instructions = [u64::MAX / 2; 2];
            let more = (then.count.cycles * OTHER_COMPILERS_PERCENT).div_ceil(100);
            cycles = [u64::MAX / 2, cycles[1] + more];
        }
        let is_beyond =
            |now: u64, then: u64, [less, more]: [u64; 2]| now + less < then || now > then + more;
        let part = |what, now, then, allowance| {
            is_beyond(now, then, allowance).then(|| format!("{now} {what}, accepted are {then}"))
        };
        let name = format!("{}, K = {}, {}", now.kernel, now.centres, now.scope.name());
        part("instructions", now.count.instructions, then.count.instructions, instructions)
            .or_else(|| part("cycles", now.count.cycles, then.count.cycles, cycles))
            .map(|difference| format!("{name}: {difference}"))
    };
    pairs.iter().filter_map(apart).collect()
}

/// Numbers of instructions, and of cycles, by which a figure may be below and above the accepted one.
fn allowances(accepted: &Figure) -> [[u64; 2]; 2] {
    let Count { instructions, cycles } = accepted.count;
    let part = |count: u64| (count * TOLERANCE_PERCENT).div_ceil(100);
    let is_one_of = |kernels: &[&str]| kernels.contains(&accepted.kernel.as_str());
    // Rows at rest are skipped, so that nothing is clamped.
    let rests = matches!(accepted.scope, Scope::RestingFrame | Scope::ArrayRestingFrame);
    let varies = !rests && is_one_of(&DATA_DEPENDENT);
    let instructions = if varies { part(instructions) } else { 0 };
    let clamped_rows = match accepted.scope {
        Scope::AwakeFrame if is_one_of(&CLAMPING) => ROWS,
        Scope::ArrayAwakeFrame if is_one_of(&CLAMPING) => 1,
        _ => 0,
    };
    [
        [instructions, instructions + clamped_rows * CLAMPED_ROW.instructions],
        [part(cycles), part(cycles) + clamped_rows * CLAMPED_ROW.cycles],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(kernel: &str, scope: Scope, instructions: u64, cycles: u64) -> Figure {
        let count = Count { instructions, cycles };
        Figure { kernel: kernel.into(), centres: 64, affine: true, scope, count }
    }

    #[test]
    fn instructions_are_exact_but_where_exponentials_branch_and_readings_are_clamped() {
        let holds = |kernel, scope, instructions, cycles| {
            let accepted = [figure(kernel, scope, 1000, 2000)];
            let measured = [figure(kernel, scope, instructions, cycles)];
            let pairs = of_model(&accepted, &measured);
            assert_eq!(pairs.len(), 1);
            beyond(&pairs, false).is_empty()
        };
        for kernel in CLAMPING {
            assert!(holds(kernel, Scope::Frame, 1000, 2020));
            assert!(!holds(kernel, Scope::Frame, 1000, 2021));
            assert!(
                !holds(kernel, Scope::Frame, 1001, 2000) && !holds(kernel, Scope::Frame, 999, 2000)
            );
            assert!(holds(kernel, Scope::AwakeFrame, 1848, 3404));
            assert!(!holds(kernel, Scope::AwakeFrame, 999, 2000));
            assert!(!holds(kernel, Scope::AwakeFrame, 1849, 2000));
        }
        for kernel in DATA_DEPENDENT {
            assert!(
                holds(kernel, Scope::Frame, 1010, 2000) && holds(kernel, Scope::Frame, 990, 2000)
            );
            assert!(!holds(kernel, Scope::Frame, 1011, 2000));
            assert!(!holds(kernel, Scope::RestingFrame, 1001, 2000));
        }
    }

    #[test]
    fn with_another_compiler_only_more_cycles_than_its_two_per_cent_are_beyond() {
        let accepted = [figure("fixed16", Scope::Frame, 1000, 2000)];
        let is_beyond = |instructions, cycles| {
            let measured = [figure("fixed16", Scope::Frame, instructions, cycles)];
            !beyond(&of_model(&accepted, &measured), true).is_empty()
        };
        // One per cent is for the model, two for the compiler.
        assert!(!is_beyond(1500, 2060) && !is_beyond(10, 20));
        assert!(is_beyond(1000, 2061));
    }

    #[test]
    fn only_what_was_accepted_and_is_the_firmwares_is_compared() {
        let accepted = [
            figure("fixed16", Scope::Frame, 10, 20),
            figure("fixed16-portable", Scope::Frame, 30, 60),
        ];
        let mut measured = vec![
            figure("fixed16-portable", Scope::Frame, 40, 80),
            figure("fixed16", Scope::Row, 1, 2),
        ];
        assert!(of_model(&accepted, &measured).is_empty());
        measured.push(figure("fixed16", Scope::Frame, 11, 20));
        let pairs = of_model(&accepted, &measured);
        assert_eq!(
            beyond(&pairs, false),
            ["fixed16, K = 64, frame: 11 instructions, accepted are 10"]
        );
        let table = table(&pairs);
        assert!(table.contains(
            "fixed16                  64  yes frame               |           11        10"
        ));
    }
}
