//! What a model is worth, as `run` and `eval` tell it.

use taxel_learn::decoders::mean;

use super::errors::Pictures;
use super::face::Face;
use super::format::{decimals, fixed, grouped, named, significant, symbol, with_unit};
use super::sections::{Digits, Fact, Section, Sections, TableOf, number_value};
use super::{errors, frames, moving, noise, over_time, sketch, table1};
use taxel_evaluate::by_load::LoadErrors;
use taxel_evaluate::evaluate::confidence::{Coverage, Covered};
use taxel_evaluate::evaluate::device_cost::DeviceCost;
use taxel_evaluate::evaluate::moving_contacts::{MovingContacts, MovingWay};
use taxel_evaluate::metrics::{
    self, DecoderErrors, Definition, Errors, GroupRmse, LimitSummary, NETWORK, rmse_of,
};
use taxel_evaluate::others::Others;
use taxel_evaluate::over_time::OverTime;
use taxel_evaluate::run::RowErrors;
use taxel_evaluate::table1::Table1;
use taxel_evaluate::verdict::Verdict;

/// Digits of an error in the unit of its output.
const RMSE: Digits = Digits::Significant(3);
/// Outputs of single frames that a table has at most.
const MOST_OUTPUTS: usize = 24;

/// Model and its errors on frames that it was not trained on. What only a scene knows may be missing.
#[derive(Debug, Clone)]
pub struct Judged<'a> {
    pub verdict: &'a Verdict,
    pub device: &'a DeviceCost,
    /// Errors of the model, and of decoders beside it.
    pub decoders: &'a [DecoderErrors],
    /// RMSE of the best linear decoder in the model's training, beside frames that came later; empty if it is not known.
    pub linear_at_training: &'a [GroupRmse],
    pub limit: &'a LimitSummary,
    /// Errors by the depth of the contact, or of places by the force; empty for other outputs.
    pub by_load: &'a [LoadErrors],
    /// Errors by row-wire; empty for outputs that belong to none.
    pub by_row: &'a [RowErrors],
    /// Errors on contacts that the model was not trained on.
    pub others: Option<&'a Others>,
    /// Errors and readings at rest by time, of a log.
    pub over_time: Option<&'a OverTime>,
    pub moving: Option<&'a MovingContacts>,
    /// What intervals of a model that tells deviations cover; empty without one.
    pub coverage: &'a [Coverage],
    pub percent_novel: Option<f64>,
    /// Number of frames that count.
    pub frames: usize,
    /// What pictures show; `None` for text alone.
    pub pictures: Option<Pictures<'a>>,
    /// Table 1: errors by noise and spread.
    pub table1: Option<&'a Table1>,
}

/// Sections of a model that was judged, with those on how it was `made`, whose title they have.
pub fn sections(judged: &Judged<'_>, made: Sections) -> Sections {
    let mut sections = Sections::new(&made.title);
    sections.value("verdict", judged.verdict);
    sections.value("decoders", judged.decoders);
    sections.value("limit", judged.limit);
    sections.value("over_time", &judged.over_time);
    sections.value("percent_novel", &judged.percent_novel);
    sections.value("device_cost", judged.device);
    worth(&mut sections, judged.verdict, groups(judged));
    sections.sections.push(Section::Facts(facts(judged)));
    let pictures = judged.pictures.as_ref();
    let face = pictures.and_then(|it| Face::of_electrodes(it.distribution, it.sensor));
    let drawn = pictures.filter(|it| !it.distribution.frames.is_empty());
    if let Some(pictures) = drawn {
        sections.heading("A frame, true and decoded");
        let map = face
            .as_ref()
            .map_or_else(|| frames::places(pictures), |face| frames::maps(pictures, face));
        map.into_iter().for_each(|map| sections.figure(map));
        if face.is_none() {
            sections.folded("Outputs of these frames", vec![outputs(pictures)]);
        }
    }
    sections.heading("Errors");
    all_errors(&mut sections, judged);
    if let Some(pictures) = pictures {
        sections.figure(errors::density(pictures));
        sections.figure(errors::histogram(pictures));
    }
    let by_electrode = pictures.zip(face.as_ref()).map(|(it, face)| errors::by_electrode(it, face));
    if by_electrode.is_some() || !judged.by_row.is_empty() || !judged.by_load.is_empty() {
        sections.heading("Errors by place and load");
        by_electrode.into_iter().for_each(|map| sections.figure(map));
    }
    by_row(&mut sections, judged.by_row);
    by_load(&mut sections, judged.by_load);
    coverage(&mut sections, judged);
    if let Some(log) = judged.over_time.filter(|_| pictures.is_some()) {
        sections.heading("Over time");
        sections.figure(over_time::errors(log));
        log.rest.iter().for_each(|rest| sections.figure(over_time::at_rest(log, rest)));
    }
    others(&mut sections, judged.others, judged.decoders);
    moving_contacts(&mut sections, judged.moving);
    sections.heading("How it was made, and what it costs");
    sections.extend(made);
    cost(&mut sections, judged.device);
    if let Some(pictures) = drawn {
        let arrows = face.as_ref().and_then(|face| frames::arrows(pictures, face));
        let figures = frames::readings(pictures).into_iter().chain(arrows);
        let figures = figures.chain(pictures.sensor.map(sketch::figure));
        let figures = figures.map(Section::Figure).collect();
        sections.folded("Readings and other pictures", figures);
    }
    if let (Some(table), Some(group)) = (judged.table1, main_group(groups(judged))) {
        sections.heading("Noise");
        sections.figure(noise::error_by_noise(table, &group.group, &group.unit));
        if let Some(nearest) = table.nearest_formula() {
            let mut beside = Sections::default();
            table1::compare(&mut beside, &table.comparison, nearest);
            sections.folded("Compared with Table 1 of the paper", beside.sections);
        }
    }
    sections
}

/// Sets what a model is worth as the lead.
pub fn worth(sections: &mut Sections, verdict: &Verdict, groups: &[Errors]) {
    sections.lead = named(&verdict.sentence, names(groups));
    let warnings = verdict.warnings.iter();
    sections.warnings =
        warnings.map(|it| format!("{} ({})", named(&it.text, names(groups)), it.name)).collect();
}

/// Names of groups, as columns have them.
fn names(groups: &[Errors]) -> impl Iterator<Item = &str> {
    groups.iter().map(|it| it.group.as_str())
}

/// Errors of the model.
fn groups<'a>(judged: &Judged<'a>) -> &'a [Errors] {
    judged.decoders.first().map_or(&[], |model| &model.errors)
}

/// Errors that stand for all: those along z if there are any, else the last.
fn main_group(errors: &[Errors]) -> Option<&Errors> {
    let is_z = |it: &&Errors| matches!(it.group.as_str(), "dz_mm" | "fz_n");
    errors.iter().find(is_z).or(errors.last())
}

/// Name of a group with its unit.
fn name(group: &Errors) -> String {
    with_unit(&symbol(&group.group), &group.unit)
}

/// The three numbers that are read first.
fn facts(judged: &Judged<'_>) -> Vec<Fact> {
    let fact = |label: String, value: String, unit: &str| Fact { label, value, unit: unit.into() };
    let mut facts = vec![];
    if let Some(group) = main_group(groups(judged)) {
        let name = symbol(&group.group);
        facts.push(fact(format!("RMSE of {name}"), RMSE.text(Some(group.rmse)), &group.unit));
        facts.push(match (group.ratio_to_limit, group.r_squared) {
            (Some(ratio), _) => {
                fact(format!("RMSE of {name} ÷ least possible"), fixed(ratio, 2), "")
            }
            (None, r_squared) => {
                fact(format!("R² of {name}"), Digits::Decimals(3).text(r_squared), "")
            }
        });
    }
    let us = significant(judged.device.us, 3);
    facts.push(fact("Decoding a frame at 180 MHz".into(), us, "µs"));
    facts
}

/// Adds the errors of all `decoders` by all definitions, one output after the other.
pub fn errors_of(sections: &mut Sections, decoders: &[DecoderErrors], frames: &str) {
    let mut rows: Vec<(&str, &Errors)> = vec![];
    for group in decoders.first().map_or(&[][..], |model| &model.errors) {
        for decoder in decoders {
            let errors = decoder.errors.iter().find(|it| it.group == group.group);
            rows.extend(errors.map(|errors| (decoder.decoder.as_str(), errors)));
        }
    }
    let caption = format!(
        "Errors {frames}. Mean: always predicting the mean; a decoder that is no better has learnt nothing."
    );
    let mut table = TableOf::new(&rows, caption)
        .names("output", "output", |(_, errors)| name(errors))
        .names("decoder", "decoder", |(decoder, _)| (*decoder).into());
    for definition in Definition::ALL {
        let digits = Digits::of(&definition);
        let heading = with_unit(definition.heading, definition.unit);
        table = table.texts(definition.name, &heading, |(_, errors)| {
            let value = definition.of(errors);
            match value.zip((definition.standard_error)(errors)) {
                Some((value, error)) => digits.with_error(Some([value, error])),
                None => digits.text(value),
            }
        });
    }
    sections.table(table);
    let is_defined = |it: &Definition| rows.iter().any(|(_, errors)| it.of(errors).is_some());
    let formulas = Definition::ALL.iter().filter(|it| is_defined(it)).map(Definition::in_words);
    sections.note(format!(
        "{}. Error e = decoded − true; Δ: true output.",
        formulas.collect::<Vec<_>>().join("; ")
    ));
}

/// Adds the errors of all decoders, and what no decoder can pass.
fn all_errors(sections: &mut Sections, judged: &Judged<'_>) {
    errors_of(sections, judged.decoders, &format!("on {} frames", grouped(judged.frames)));
    let linear = TableOf::new(judged.linear_at_training, "The best linear decoder in training.")
        .values("group", |it| it.group.as_str().into())
        .values("unit", |it| it.unit.as_str().into())
        .values("rmse", |it| number_value(Some(it.rmse)));
    sections.rows("linear_at_training", linear);
    let linear = judged.linear_at_training.iter().map(|it| {
        let text = format!("{} {} {}", symbol(&it.group), significant(it.rmse, 3), it.unit);
        text.trim_end().to_owned()
    });
    let linear = linear.collect::<Vec<_>>().join(", ");
    if !linear.is_empty() {
        sections.note(format!(
            "RMSE of the best linear decoder in training, on frames that it was not fitted to: {linear}."
        ));
    }
    sections.note(named(&judged.limit.note(), names(groups(judged))));
}

/// Adds the RMSE of each of the `groups` of outputs.
fn with_rmse<'r, R>(
    mut table: TableOf<'r, R>,
    groups: &[Errors],
    errors: impl Fn(&'r R) -> &'r [Errors],
) -> TableOf<'r, R> {
    for Errors { group, unit, .. } in groups {
        let key = format!("rmse_{group}");
        table = table.numbers(&key, &symbol(group), unit, RMSE, |row| rmse_of(errors(row), group));
    }
    table
}

/// Coefficient of determination of a `group`.
fn r_squared(errors: &[Errors], group: &str) -> Option<f64> {
    errors.iter().find(|it| it.group == group)?.r_squared
}

fn by_row(sections: &mut Sections, rows: &[RowErrors]) {
    let groups = rows.first().map_or(&[][..], |row| &row.errors);
    let table =
        TableOf::new(rows, "RMSE of the model by row-wire.")
            .named("row_wire", "row-wire", |row| (row.row_wire.to_string(), row.row_wire.into()));
    sections.table_as("by_row", with_rmse(table, groups, |row| &row.errors));
}

fn by_load(sections: &mut Sections, ranges: &[LoadErrors]) {
    let mut rows: Vec<(&LoadErrors, &str, &[Errors])> = vec![];
    for range in ranges {
        rows.push((range, NETWORK, &range.errors));
        if !range.centroid.is_empty() {
            rows.push((range, "centroid", &range.centroid));
        }
    }
    let (load, groups) =
        ranges.first().map_or(("", &[][..]), |first| (first.load.as_str(), &first.errors));
    let caption = format!("RMSE by the true {}.", symbol(load));
    let table = TableOf::new(&rows, caption)
        .values("load", |(range, ..)| range.load.as_str().into())
        .values("from", |(range, ..)| number_value(Some(range.from)))
        .values("to", |(range, ..)| number_value(range.to))
        .names("range", "range", |(range, ..)| range.range())
        .names("decoder", "decoder", |(_, decoder, _)| (*decoder).into())
        .numbers("frames", "frames", "", Digits::Count, |(range, ..)| Some(range.frames as f64));
    sections.table_as("by_load", with_rmse(table, groups, |(.., errors)| errors));
}

fn others(sections: &mut Sections, others: Option<&Others>, decoders: &[DecoderErrors]) {
    type Row<'r> = (&'r str, &'r [Errors], &'r [Errors], Option<f64>);
    let Some(others) = others else { return sections.value("others", &[(); 0]) };
    let [own, own_mean] = [NETWORK, mean::NAME].map(|name| metrics::of_decoder(decoders, name));
    let mut rows: Vec<Row<'_>> = vec![("as trained", own, own_mean, others.own_percent_novel)];
    let contacts = others.contacts.iter();
    rows.extend(
        contacts.map(|it| (it.name.as_str(), &it.errors[..], &it.mean[..], it.percent_novel)),
    );
    sections.heading("Other contacts");
    let novel = match others.own_percent_novel {
        Some(_) => " Novel: share of the frames that the reading model finds novel.",
        None => "",
    };
    let caption = format!(
        "RMSE and R² on contacts that the model was not trained on, {} frames each. Mean: RMSE of always predicting the mean of \
         training.{novel}",
        grouped(others.frames)
    );
    let mut table = TableOf::new(&rows, caption).names("contact", "contact", |row| row.0.into());
    for Errors { group, unit, .. } in own {
        let [rmse, r2, of_mean] =
            ["rmse", "r_squared", "mean_rmse"].map(|name| format!("{name}_{group}"));
        table = table
            .numbers(&rmse, &symbol(group), unit, RMSE, |row| rmse_of(row.1, group))
            .numbers(&r2, "R²", "", Digits::Decimals(2), |row| r_squared(row.1, group))
            .numbers(&of_mean, "mean", "", RMSE, |row| rmse_of(row.2, group));
    }
    let table = table.numbers("percent_novel", "novel", "%", Digits::Decimals(1), |row| row.3);
    sections.table_as("others", table);
}

/// Adds errors with and without a filter and of the baselines, beside the age of an estimate, and a trajectory.
fn moving_contacts(sections: &mut Sections, moving: Option<&MovingContacts>) {
    type Row<'r> = (String, Option<&'r MovingWay>, &'r [Errors]);
    let Some(moving) = moving else { return sections.value("moving", &[(); 0]) };
    sections.heading("Contacts that move");
    let ways = moving.ways.iter().map(|way| {
        let name = match way.filter {
            Some(filter) => {
                let [tau, lead] = [filter.time_constant_ms, filter.lead_ms].map(|ms| fixed(ms, 1));
                format!("{NETWORK}, filter of {tau} ms, {lead} ms ahead")
            }
            None if way.is_tracked => format!("{NETWORK}, tracked"),
            None => NETWORK.to_owned(),
        };
        (name, Some(way), &way.errors[..])
    });
    let baselines = moving.decoders.iter().map(|it| (it.decoder.clone(), None, &it.errors[..]));
    let rows: Vec<Row<'_>> = ways.chain(baselines).collect();
    let caption = format!(
        "RMSE and R² as a robot sees them, on {}: every ms, the newest finished estimate of the board is compared with the \
         truth at that moment. Age: mean time from the middle of a scan until its estimate is used. × limit: ratio to the least \
         possible RMSE from all scans that are finished by then, without delay.",
        moving.path.in_words()
    );
    let filter = |row: &Row<'_>| row.1.and_then(|way| way.filter);
    let mut table = TableOf::new(&rows, caption)
        .names("decoder", "decoder", |(name, ..)| name.clone())
        .values("filter_ms", |row| number_value(filter(row).map(|it| it.time_constant_ms)))
        .values("lead_ms", |row| number_value(filter(row).map(|it| it.lead_ms)))
        .values("frames_per_s", |row| number_value(row.1.map(|way| way.times.frames_per_s)))
        .numbers("age_ms", "age", "ms", Digits::Decimals(2), |row| row.1?.times.age_ms);
    for Errors { group, unit, .. } in rows.first().map_or(&[][..], |(.., errors)| errors) {
        let [rmse, r2, ratio, error] =
            ["rmse", "r_squared", "ratio_to_limit", "ratio_standard_error"]
                .map(|name| format!("{name}_{group}"));
        let ratio = [ratio.as_str(), &error];
        table = table
            .numbers(&rmse, &symbol(group), unit, RMSE, |(.., errors)| rmse_of(errors, group))
            .numbers(&r2, "R²", "", Digits::Decimals(3), |(.., errors)| r_squared(errors, group))
            .estimates(ratio, "× limit", "", Digits::Decimals(2), |(.., errors)| {
                let of_group = errors.iter().find(|it| it.group == *group)?;
                Some([of_group.ratio_to_limit?, of_group.ratio_standard_error?])
            });
    }
    sections.table_as("moving", table);
    let groups = names(&moving.ways[0].errors);
    sections.note(named(&moving.limit.note(), groups));
    sections.value("moving_limit", &moving.limit);
    for filter in moving.ways.iter().filter_map(|way| way.filter) {
        sections.note(format!(
            "The filter on a device: `taxel link PORT configure --filter-ms {} --lead-ms {}` (docs/rate.md).",
            filter.time_constant_ms, filter.lead_ms
        ));
    }
    sections.figure(moving::trajectory(moving));
}

fn coverage(sections: &mut Sections, judged: &Judged<'_>) {
    let Some(percent) = judged.percent_novel else {
        return sections.value("coverage", &[(); 0]);
    };
    let mut rows: Vec<(&Coverage, &str, Covered)> = vec![];
    for group in judged.coverage {
        rows.push((group, "all outputs", group.all));
        rows.push((group, "surest quarter", group.surest_quarter));
        rows.push((group, "least sure quarter", group.least_sure_quarter));
    }
    sections.heading("Reading model");
    let caption =
        "Share of the errors that are within the model’s intervals of 68.3 % and of 95 %.";
    let table = TableOf::new(&rows, caption)
        .names("output", "output", |(group, ..)| with_unit(&symbol(&group.group), &group.unit))
        .names("of", "of", |(_, part, _)| (*part).into())
        .values("count", |(.., it)| it.count.into())
        .numbers("rmse", "RMSE", "", RMSE, |(.., it)| Some(it.rmse))
        .numbers("percent_within_68", "within 68.3 %", "%", Digits::Decimals(1), |(.., it)| {
            Some(it.percent_within_68)
        })
        .numbers("percent_within_95", "within 95 %", "%", Digits::Decimals(1), |(.., it)| {
            Some(it.percent_within_95)
        });
    sections.table_as("coverage", table);
    sections.note(format!("{percent:.2} % of the frames are novel: unlike those of training."));
}

/// Table of the outputs of single frames, true and decoded.
fn outputs(pictures: &Pictures<'_>) -> Section {
    let shown = pictures.distribution;
    let rows: Vec<_> = shown.outputs.iter().enumerate().take(MOST_OUTPUTS).collect();
    let caption = format!("{} of {} outputs, true and decoded.", rows.len(), shown.outputs.len());
    let mut table = TableOf::new(&rows, caption)
        .names("output", "output", |(_, output)| with_unit(&symbol(&output.name), &output.unit));
    for frame in &shown.frames {
        for (what, line) in [("true", &frame.truth), ("decoded", &frame.estimate)] {
            let heading = format!("{} ({}), {what}", frames::name(frame), frame.frame);
            table = table.texts(&heading, &heading, |(column, output)| {
                fixed(line[*column], decimals(output.rmse, 2))
            });
        }
    }
    Section::Table(table.table())
}

/// Adds what decoding costs a device.
fn cost(sections: &mut Sections, device: &DeviceCost) {
    let weights = if device.weights_in_ram {
        "the images copy the weights there too, as many bytes as the blob has"
    } else {
        "weights stay in flash"
    };
    let [cycles, ram, blob, slot] =
        [device.cycles as usize, device.ram_bytes, device.blob_bytes, device.slot_bytes]
            .map(grouped);
    let fits = if device.fits_slot { "fits" } else { "does not fit" };
    let processor = "a Cortex-M4F with zero wait states, as predicted by docs/cycles.md";
    sections.line("Decoding", format!("{cycles} cycles of {processor}"));
    sections.line("RAM for decoding", format!("{ram} bytes; {weights}"));
    sections.line("Flash", format!("{blob} bytes: the blob {fits} a slot of {slot} bytes"));
}
