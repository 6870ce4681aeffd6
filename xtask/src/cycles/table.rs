//! Figures as text: tables in Markdown, and JSON.

use super::figures::Figure;
use super::trace::Count;

/// Clock for which times at zero wait are given: the usual highest one of an STM32F4.
const CLOCK_MHZ: f64 = 168.0;

/// Clock for which times from flash are given: the highest one of an STM32F446, which has 5 wait states.
const FLASH_CLOCK_MHZ: f64 = 180.0;

const HEAD: &str = "\
| kernel | K | inference: instructions | cycles | from flash | row | frame | µs at 168 MHz | from flash: µs at 180 MHz | with tail: row | frame | µs | from flash: µs |
|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|
";

const ARRAY_HEAD: &str = "\
| kernel | K | frame: instructions | cycles | µs at 168 MHz | from flash: µs at 180 MHz | with tail | µs | from flash: µs |
|---|--:|--:|--:|--:|--:|--:|--:|--:|
";

/// Kernels and numbers of centres that the tables show; the file of figures has all.
const SHOWN: ([&str; 2], [u64; 3]) = (["f32", "fixed16"], [16, 64, 256]);

/// All figures of one kernel and K.
type Group<'f> = &'f [Figure];

/// Groups that the tables show.
fn shown(figures: &[Figure]) -> impl Iterator<Item = Group<'_>> {
    let (kernels, centres) = SHOWN;
    groups(figures).filter(move |group| {
        kernels.contains(&group[0].kernel.as_str()) && centres.contains(&group[0].centres)
    })
}

/// The groups in `figures`, which must be sorted by kernel and K.
fn groups(figures: &[Figure]) -> impl Iterator<Item = Group<'_>> {
    figures.chunk_by(|a, b| (&a.kernel, a.centres) == (&b.kernel, b.centres))
}

fn count(group: Group<'_>, affine: bool, scope: &str) -> Option<Count> {
    let of = |figure: &&Figure| (figure.affine, &*figure.scope) == (affine, scope);
    group.iter().find(of).map(|figure| figure.count)
}

fn instructions(count: Count) -> String {
    count.instructions.to_string()
}

fn cycles(count: Count) -> String {
    count.cycles.to_string()
}

fn flash_cycles(count: Count) -> String {
    count.flash_cycles.to_string()
}

fn microseconds(count: Count) -> String {
    format!("{:.0}", count.cycles as f64 / CLOCK_MHZ)
}

fn flash_microseconds(count: Count) -> String {
    format!("{:.0}", count.flash_cycles as f64 / FLASH_CLOCK_MHZ)
}

/// A cell of a table: whether of a model with an affine tail, the scope, and what is shown of its count.
type Cell<'c> = (bool, &'c str, fn(Count) -> String);

/// A line of a table: kernel, K, and these cells; those that were not measured are empty.
fn line(group: Group<'_>, cells: &[Cell<'_>]) -> String {
    let cells = cells.iter().map(|(affine, scope, shown)| {
        let shown = count(group, *affine, scope).map(shown).unwrap_or_default();
        format!(" {shown} |")
    });
    format!("| {} | {} |{}\n", group[0].kernel, group[0].centres, cells.collect::<String>())
}

/// Markdown tables of what a network costs that is one of rows, or that of the whole array. Numbers without a unit are cycles.
pub fn markdown(figures: &[Figure]) -> String {
    let has = |group: Group<'_>, scope| count(group, false, scope).is_some();
    let rows = shown(figures).filter(|group| has(group, "inference")).map(|group| {
        line(
            group,
            &[
                (false, "inference", instructions),
                (false, "inference", cycles),
                (false, "inference", flash_cycles),
                (false, "row", cycles),
                (false, "frame", cycles),
                (false, "frame", microseconds),
                (false, "frame", flash_microseconds),
                (true, "row", cycles),
                (true, "frame", cycles),
                (true, "frame", microseconds),
                (true, "frame", flash_microseconds),
            ],
        )
    });
    let arrays = shown(figures).filter(|group| has(group, "array-frame")).map(|group| {
        line(
            group,
            &[
                (false, "array-frame", instructions),
                (false, "array-frame", cycles),
                (false, "array-frame", microseconds),
                (false, "array-frame", flash_microseconds),
                (true, "array-frame", cycles),
                (true, "array-frame", microseconds),
                (true, "array-frame", flash_microseconds),
            ],
        )
    });
    format!(
        "{HEAD}{}\nOne network for the whole array ([projection.md](projection.md)):\n\n{ARRAY_HEAD}{}",
        rows.collect::<String>(),
        arrays.collect::<String>(),
    )
}

/// JSON list of all figures as objects. Kernels' names contain nothing that JSON would escape.
pub fn json(figures: &[Figure]) -> String {
    let objects = groups(figures).map(|group| {
        let mut members = vec![
            format!("\"kernel\": \"{}\"", group[0].kernel),
            format!("\"centres\": {}", group[0].centres),
        ];
        let of_rows = ["row", "frame"];
        let of_array = ["array-frame"];
        let parts = [(false, &["inference"][..]), (false, &of_rows), (true, &of_rows)];
        let parts = parts.into_iter().chain([(false, &of_array[..]), (true, &of_array)]);
        for (affine, scope) in parts.flat_map(|(affine, of)| of.iter().map(move |it| (affine, it)))
        {
            let tail = if affine { "affine_" } else { "" };
            let prefix = match *scope {
                "inference" => String::new(),
                _ => format!("{tail}{}_", scope.replace('-', "_")),
            };
            if let Some(count) = count(group, affine, scope) {
                let names = ["instructions", "cycles", "flash_cycles"].into_iter().zip(count.all());
                members.extend(names.map(|(name, number)| format!("\"{prefix}{name}\": {number}")));
            }
        }
        format!("{{{}}}", members.join(", "))
    });
    format!("[\n  {}\n]\n", objects.collect::<Vec<_>>().join(",\n  "))
}

#[cfg(test)]
mod tests {
    use super::super::figures::tests::figure;
    use super::*;

    #[test]
    fn json_names_every_figure_that_was_measured() {
        let figures = [
            figure("f32", "inference", false, 336),
            figure("f32", "frame", true, 7),
            figure("f32", "array-frame", false, 9),
            figure("f32-portable", "inference", false, 8),
        ];
        assert_eq!(
            json(&figures),
            "[\n  {\"kernel\": \"f32\", \"centres\": 64, \"instructions\": 100, \"cycles\": 336, \
             \"flash_cycles\": 436, \"affine_frame_instructions\": 100, \
             \"affine_frame_cycles\": 7, \"affine_frame_flash_cycles\": 107, \
             \"array_frame_instructions\": 100, \"array_frame_cycles\": 9, \"array_frame_flash_cycles\": 109},\n  \
             {\"kernel\": \"f32-portable\", \"centres\": 64, \"instructions\": 100, \"cycles\": 8, \
             \"flash_cycles\": 108}\n]\n"
        );
    }
}
