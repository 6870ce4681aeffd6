//! Figures as text: tables for people, and JSON.

use std::fmt::Write as _;

use model_core::rbf::{Shape, expanded, fixed16};
use taxel_learn::cost::least_waiting_for_weights;

use super::figures::{Figure, Group, Scope};
use super::regions::Count;

/// Clock for which times at zero wait are given: the usual highest one of an STM32F4.
const CLOCK_MHZ: f64 = 168.0;

/// Clock for which times from flash are given: the highest one of an STM32F446, which has 5 wait states.
const FLASH_CLOCK_MHZ: f64 = 180.0;

const HEAD: &str = "\
| kernel | K | inference: instructions | cycles | from flash | row | frame | µs at 168 MHz | from flash: µs at 180 MHz | with tail: row | frame | µs | from flash: µs |
|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|
";

const WEIGHTS_HEAD: &str = "\
| kernel | zero wait | from flash, weights in RAM | relative | weights in flash, at least | relative |
|---|--:|--:|--:|--:|--:|
";

/// Number of centres K of the table of weights in RAM and in flash.
const WEIGHTS_CENTRES: usize = 64;

const SAVED_HEAD: &str = "\
| kernel | K | inference, compiled | assembly | of it |
|---|--:|--:|--:|--:|
";

const ALIGNED_HEAD: &str = concat!(
    "                         |              inference |    row    frame  µs at    flash, ",
    "| with tail:      µs at    flash,\n",
    "kernel                 K | instr.  cycles   flash | cycles   cycles    168 µs at 180 ",
    "|    row   frame    168 µs at 180\n",
);

const ARRAY_HEAD: &str = "\
| kernel | K | frame: instructions | cycles | µs at 168 MHz | from flash: µs at 180 MHz | at rest | with tail | µs | from flash: µs |
|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|
";

const ALIGNED_ARRAY_HEAD: &str = concat!(
    "\nby one network for       |           frame  µs at    flash, | with tail:   µs at    flash,\n",
    "the whole array        K | instr.   cycles    168 µs at 180 |    frame    168 µs at 180\n",
);

/// Suffix to a kernel's name that names its compiled twin.
const TWIN: &str = "-portable";

/// Markdown tables of all figures, and of what assembly saves. Numbers without a unit are cycles.
pub fn markdown(figures: &[Figure]) -> String {
    let cell =
        |count: Option<Count>, shown: fn(Count) -> String| count.map_or(String::new(), shown);
    let rows = Group::of(figures).map(|group| {
        let count = |affine, scope| group.count(affine, scope);
        let cells = [
            group.kernel().to_owned(),
            group.centres().to_string(),
            cell(count(false, Scope::Inference), |count| count.instructions.to_string()),
            cell(count(false, Scope::Inference), cycles),
            cell(count(false, Scope::Inference), flash_cycles),
            cell(count(false, Scope::Row), cycles),
            cell(count(false, Scope::Frame), cycles),
            cell(count(false, Scope::Frame), microseconds),
            cell(count(false, Scope::Frame), flash_microseconds),
            cell(count(true, Scope::Row), cycles),
            cell(count(true, Scope::Frame), cycles),
            cell(count(true, Scope::Frame), microseconds),
            cell(count(true, Scope::Frame), flash_microseconds),
        ];
        line(&cells)
    });
    let inference = |group: Group<'_>| group.count(false, Scope::Inference);
    let saved = Group::of(figures).filter_map(|group| {
        let twin = format!("{}{TWIN}", group.kernel());
        let twin = Group::of(figures)
            .find(|other| other.kernel() == twin && other.centres() == group.centres())?;
        let (compiled, assembly) = (inference(twin)?.cycles, inference(group)?.cycles);
        let part = format!("{:.0} %", 100.0 * assembly as f64 / compiled as f64);
        let numbers = [group.centres(), compiled, assembly].map(|number| number.to_string());
        Some(line(&[&[group.kernel().to_owned()][..], &numbers, &[part]].concat()))
    });
    let powers = Group::of(figures).filter_map(|group| {
        let powers = group.count(false, Scope::Exponential)?;
        let each = powers.cycles as f64 / group.centres() as f64;
        Some(format!("- {}, K = {}: {each:.1} cycles\n", group.kernel(), group.centres()))
    });
    let arrays = Group::of(figures).filter_map(|group| {
        let frame = group.count(false, Scope::ArrayFrame)?;
        let tail = group.count(true, Scope::ArrayFrame);
        let cells = [
            group.kernel().to_owned(),
            group.centres().to_string(),
            frame.instructions.to_string(),
            cycles(frame),
            microseconds(frame),
            flash_microseconds(frame),
            cell(group.count(false, Scope::ArrayRestingFrame), cycles),
            cell(tail, cycles),
            cell(tail, microseconds),
            cell(tail, flash_microseconds),
        ];
        Some(line(&cells))
    });
    let weights = Group::of(figures)
        .filter(|group| group.centres() == WEIGHTS_CENTRES as u64)
        .filter_map(|group| {
            let Count { cycles, flash_cycles, .. } = inference(group)?;
            let floor = flash_cycles + least_waiting_for_weights(bytes_of_weights(group.kernel())?);
            let relative = |more: u64| format!("{:.2}", more as f64 / cycles as f64);
            Some(line(&[
                group.kernel().to_owned(),
                cycles.to_string(),
                flash_cycles.to_string(),
                relative(flash_cycles),
                floor.to_string(),
                relative(floor),
            ]))
        });
    format!(
        "{HEAD}{}\nOne network for the whole array ([projection.md](projection.md)):\n\n{ARRAY_HEAD}{}\n\
         What assembly saves:\n\n{SAVED_HEAD}{}\nOne exponential:\n\n{}\n\
         Where weights are, in an inference with K = {WEIGHTS_CENTRES}:\n\n{WEIGHTS_HEAD}{}",
        rows.collect::<String>(),
        arrays.collect::<String>(),
        saved.collect::<String>(),
        powers.collect::<String>(),
        weights.collect::<String>()
    )
}

/// Bytes that an inference without tail reads of the paper's network with [`WEIGHTS_CENTRES`]: all but the scaling of
/// its inputs. `None` for a kernel that is no assembly routine.
fn bytes_of_weights(kernel: &str) -> Option<usize> {
    let shape = Shape { inputs: 18, centres: WEIGHTS_CENTRES, outputs: 18 };
    let words = match kernel {
        "f32" => expanded::Network::block_words(shape, false),
        "fixed16" => fixed16::Network::block_words(shape, false),
        _ => return None,
    };
    let scaling = 2 * shape.inputs;
    Some(4 * (words - scaling))
}

fn line(cells: &[String]) -> String {
    format!("| {} |\n", cells.join(" | "))
}

fn cycles(count: Count) -> String {
    count.cycles.to_string()
}

fn microseconds(count: Count) -> String {
    format!("{:.0}", count.cycles as f64 / CLOCK_MHZ)
}

fn flash_cycles(count: Count) -> String {
    count.flash_cycles.to_string()
}

fn flash_microseconds(count: Count) -> String {
    format!("{:.0}", count.flash_cycles as f64 / FLASH_CLOCK_MHZ)
}

/// Tables of all figures with aligned columns, for a terminal.
pub fn aligned(figures: &[Figure]) -> String {
    let of_rows = Group::of(figures).filter(|group| {
        group.count(true, Scope::Row).is_some() || group.count(false, Scope::Row).is_some()
    });
    let rows = of_rows.map(|group| {
        let shown = |affine, scope, shown: fn(Count) -> String| {
            group.count(affine, scope).map_or("–".into(), shown)
        };
        let instructions = shown(false, Scope::Inference, |count| count.instructions.to_string());
        format!(
            "{:20} {:3} | {instructions:>6} {:>7} {:>7} | {:>6} {:>8} {:>6} {:>9} | {:>6} {:>7} {:>6} {:>9}\n",
            group.kernel(),
            group.centres(),
            shown(false, Scope::Inference, cycles),
            shown(false, Scope::Inference, flash_cycles),
            shown(false, Scope::Row, cycles),
            shown(false, Scope::Frame, cycles),
            shown(false, Scope::Frame, microseconds),
            shown(false, Scope::Frame, flash_microseconds),
            shown(true, Scope::Row, cycles),
            shown(true, Scope::Frame, cycles),
            shown(true, Scope::Frame, microseconds),
            shown(true, Scope::Frame, flash_microseconds),
        )
    });
    let arrays = Group::of(figures).filter_map(|group| {
        let frame = group.count(false, Scope::ArrayFrame)?;
        let tail = group.count(true, Scope::ArrayFrame);
        let shown =
            |count: Option<Count>, shown: fn(Count) -> String| count.map_or("–".into(), shown);
        Some(format!(
            "{:20} {:3} | {:>6} {:>8} {:>6} {:>9} | {:>8} {:>6} {:>9}\n",
            group.kernel(),
            group.centres(),
            frame.instructions,
            frame.cycles,
            microseconds(frame),
            flash_microseconds(frame),
            shown(tail, cycles),
            shown(tail, microseconds),
            shown(tail, flash_microseconds),
        ))
    });
    let arrays = arrays.collect::<String>();
    let head = if arrays.is_empty() { "" } else { ALIGNED_ARRAY_HEAD };
    format!("{ALIGNED_HEAD}{}{head}{arrays}", rows.collect::<String>())
}

/// JSON list of all figures as objects. Kernels' names contain nothing that JSON would escape.
pub fn json(figures: &[Figure]) -> String {
    let objects: Vec<String> = Group::of(figures)
        .map(|group| {
            let mut object =
                format!("{{\"kernel\": \"{}\", \"centres\": {}", group.kernel(), group.centres());
            for (prefix, affine, scope) in [
                ("", false, Scope::Inference),
                ("row_", false, Scope::Row),
                ("frame_", false, Scope::Frame),
                ("resting_frame_", false, Scope::RestingFrame),
                ("awake_frame_", false, Scope::AwakeFrame),
                ("affine_row_", true, Scope::Row),
                ("affine_frame_", true, Scope::Frame),
                ("affine_resting_frame_", true, Scope::RestingFrame),
                ("affine_awake_frame_", true, Scope::AwakeFrame),
                ("array_frame_", false, Scope::ArrayFrame),
                ("array_resting_frame_", false, Scope::ArrayRestingFrame),
                ("array_awake_frame_", false, Scope::ArrayAwakeFrame),
                ("affine_array_frame_", true, Scope::ArrayFrame),
                ("affine_array_resting_frame_", true, Scope::ArrayRestingFrame),
                ("affine_array_awake_frame_", true, Scope::ArrayAwakeFrame),
            ] {
                if let Some(count) = group.count(affine, scope) {
                    for (name, number) in [
                        ("instructions", count.instructions),
                        ("cycles", count.cycles),
                        ("flash_cycles", count.flash_cycles),
                    ] {
                        // Writing to a string cannot fail.
                        let _ = write!(object, ", \"{prefix}{name}\": {number}");
                    }
                }
            }
            object + "}"
        })
        .collect();
    format!("[\n  {}\n]\n", objects.join(",\n  "))
}

#[cfg(test)]
pub mod tests {
    use super::*;

    /// Figures of two kernels, of which one is the other's compiled twin.
    pub fn sample() -> Vec<Figure> {
        let figure = |kernel: &str, affine, scope, n| Figure {
            kernel: kernel.into(),
            centres: 16,
            affine,
            scope,
            count: Count { instructions: n, cycles: 168 * n, flash_cycles: 180 * n },
        };
        vec![
            figure("f32", false, Scope::Inference, 2),
            figure("f32", false, Scope::Exponential, 1),
            figure("f32", false, Scope::Row, 3),
            figure("f32", false, Scope::Frame, 4),
            figure("f32", true, Scope::Row, 5),
            figure("f32", true, Scope::Frame, 6),
            figure("f32", false, Scope::ArrayFrame, 9),
            figure("f32", true, Scope::ArrayFrame, 10),
            figure("f32-portable", false, Scope::Inference, 8),
        ]
    }

    #[test]
    fn tables_say_what_was_measured_and_what_assembly_saves() {
        let text = markdown(&sample());
        for line in [
            "\n| f32 | 16 | 2 | 336 | 360 | 504 | 672 | 4 | 4 | 840 | 1008 | 6 | 6 |\n",
            "\n| f32-portable | 16 | 8 | 1344 | 1440 |  |  |  |  |  |  |  |  |\n",
            "\n| f32 | 16 | 1344 | 336 | 25 % |\n",
            "\n| f32 | 16 | 9 | 1512 | 9 | 9 |  | 1680 | 10 | 10 |\n",
            "\n- f32, K = 16: 10.5 cycles\n",
        ] {
            assert!(text.contains(line), "{text}");
        }
        let aligned = aligned(&sample());
        assert!(aligned.contains(" 336     360 |"), "{aligned}");
        assert!(aligned.contains("    1512      9         9 |     1680"), "{aligned}");
    }

    #[test]
    fn json_names_every_figure() {
        assert_eq!(
            json(&sample()),
            "[\n  {\"kernel\": \"f32\", \"centres\": 16, \"instructions\": 2, \"cycles\": 336, \
             \"flash_cycles\": 360, \"row_instructions\": 3, \"row_cycles\": 504, \"row_flash_cycles\": 540, \
             \"frame_instructions\": 4, \"frame_cycles\": 672, \"frame_flash_cycles\": 720, \
             \"affine_row_instructions\": 5, \"affine_row_cycles\": 840, \"affine_row_flash_cycles\": 900, \
             \"affine_frame_instructions\": 6, \"affine_frame_cycles\": 1008, \
             \"affine_frame_flash_cycles\": 1080, \"array_frame_instructions\": 9, \
             \"array_frame_cycles\": 1512, \"array_frame_flash_cycles\": 1620, \
             \"affine_array_frame_instructions\": 10, \"affine_array_frame_cycles\": 1680, \
             \"affine_array_frame_flash_cycles\": 1800},\n  \
             {\"kernel\": \"f32-portable\", \"centres\": 16, \"instructions\": 8, \"cycles\": 1344, \
             \"flash_cycles\": 1440}\n]\n"
        );
    }

    #[test]
    fn weights_in_flash_add_five_cycles_for_each_of_their_lines() {
        let figure = |kernel: &str, cycles| {
            let count = Count { instructions: 1, cycles, flash_cycles: cycles + 1000 };
            let (kernel, scope) = (kernel.into(), Scope::Inference);
            Figure { kernel, centres: 64, affine: false, scope, count }
        };
        let figures = [figure("f32", 10_000), figure("fixed16", 4000), figure("f32-direct", 1)];
        let text = markdown(&figures);
        let (_, table) = text.split_once(WEIGHTS_HEAD).unwrap();
        // f32: 18 biases, the decay, and 64·(1 + 18 + 18) words are 9548 bytes or 597 lines. fixed16: 18 biases,
        // 18 scales, the decay, and 64·(1 + 9 + 9) words are 5012 bytes or 314 lines.
        assert_eq!(
            table,
            "| f32 | 10000 | 11000 | 1.10 | 13985 | 1.40 |\n\
             | fixed16 | 4000 | 5000 | 1.25 | 6570 | 1.64 |\n"
        );
    }
}
