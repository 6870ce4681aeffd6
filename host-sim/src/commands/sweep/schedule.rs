//! Which shard this is, by the scheduler that started the program.

use crate::sweep::Shard;
use crate::{Error, Result};

use super::super::Common;

/// Variables in which schedulers say which task this is; one that may run inside another stands before it.
const INDICES: [&str; 3] = ["PARALLEL_SEQ", "HQ_TASK_ID", "SLURM_ARRAY_TASK_ID"];

/// Shard that was asked for, or that the scheduler names; `None` for the whole plan.
///
/// # Errors
/// [`Error::Usage`] for a number of shards without a task, and for an array of Slurm that is not 1 to N.
pub fn shard(
    given: Option<Shard>,
    shards: Option<usize>,
    common: &Common,
) -> Result<Option<Shard>> {
    let found = chosen(given, shards, &|name| std::env::var(name).ok())?;
    Ok(found.map(|(shard, from)| {
        if let Some(from) = from {
            common.remark(format_args!("shard {shard}, by {from}"));
        }
        shard
    }))
}

fn chosen(
    given: Option<Shard>,
    shards: Option<usize>,
    variable: &dyn Fn(&str) -> Option<String>,
) -> Result<Option<(Shard, Option<&'static str>)>> {
    if let Some(shard) = given {
        return Ok(Some((shard, None)));
    }
    let number = |name: &str| variable(name).and_then(|text| text.parse::<usize>().ok());
    let index = INDICES.iter().find_map(|name| Some((*name, number(name)?)));
    match (shards, index) {
        (Some(count), Some((from, index))) => match Shard::new(index, count) {
            Some(shard) => Ok(Some((shard, Some(from)))),
            None => Err(Error::Usage(format!(
                "--shards {count}: {from} is {index}, and shards are 1 to {count}"
            ))),
        },
        (Some(count), None) => Err(Error::Usage(format!(
            "--shards {count}: no scheduler gives the number of this one ({}); give --shard I/{count}",
            INDICES.join(", ")
        ))),
        (None, Some((from @ "SLURM_ARRAY_TASK_ID", index))) => {
            let [count, least, most] =
                ["COUNT", "MIN", "MAX"].map(|end| number(&format!("SLURM_ARRAY_TASK_{end}")));
            let whole = count.filter(|count| least == Some(1) && most == Some(*count));
            match whole.and_then(|count| Shard::new(index, count)) {
                Some(shard) => Ok(Some((shard, Some(from)))),
                None => Err(Error::Usage(
                    "this is a task of a Slurm array that is not 1 to N, so the number of shards is unknown; give \
                     --shards N"
                        .into(),
                )),
            }
        }
        (None, Some((from, _))) if number("SLURM_ARRAY_TASK_ID").is_some() => {
            Err(Error::Usage(format!(
                "{from} is set inside a task of a Slurm array; give --shards N, or --shard 1/1 for all of the plan"
            )))
        }
        (None, _) => Ok(None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(
        given: Option<Shard>,
        shards: Option<usize>,
        variables: &[(&str, &str)],
    ) -> Result<Option<String>> {
        let variable = |name: &str| {
            let found = variables.iter().find(|(known, _)| *known == name);
            found.map(|(_, value)| (*value).to_owned())
        };
        Ok(chosen(given, shards, &variable)?.map(|(shard, _)| shard.to_string()))
    }

    #[test]
    fn the_shard_is_the_given_one_or_the_schedulers() {
        let slurm = [
            ("SLURM_ARRAY_TASK_ID", "3"),
            ("SLURM_ARRAY_TASK_COUNT", "8"),
            ("SLURM_ARRAY_TASK_MIN", "1"),
            ("SLURM_ARRAY_TASK_MAX", "8"),
        ];
        let text = |found: Result<Option<String>>| found.unwrap().unwrap_or("whole".into());
        assert_eq!(text(of(None, None, &slurm)), "3/8");
        assert_eq!(text(of(Shard::new(2, 5), None, &slurm)), "2/5");
        assert_eq!(text(of(None, Some(16), &slurm)), "3/16");
        assert_eq!(text(of(None, Some(4), &[("HQ_TASK_ID", "4")])), "4/4");
        assert_eq!(text(of(None, Some(4), &[("PARALLEL_SEQ", "1")])), "1/4");
        // GNU parallel, and workers of HyperQueue, run inside tasks of Slurm.
        let inside = |name| [slurm[0], slurm[1], slurm[2], slurm[3], (name, "5")];
        assert_eq!(text(of(None, Some(8), &inside("PARALLEL_SEQ"))), "5/8");
        assert_eq!(text(of(None, Some(8), &inside("HQ_TASK_ID"))), "5/8");
        // Others tell no number: without --shards it is no part.
        assert_eq!(text(of(None, None, &[("HQ_TASK_ID", "4"), ("PARALLEL_SEQ", "2")])), "whole");
        assert_eq!(text(of(None, None, &[])), "whole");
    }

    #[test]
    fn a_task_that_is_no_shard_is_refused() {
        let again = [
            ("SLURM_ARRAY_TASK_ID", "5"),
            ("SLURM_ARRAY_TASK_COUNT", "2"),
            ("SLURM_ARRAY_TASK_MIN", "3"),
            ("SLURM_ARRAY_TASK_MAX", "5"),
        ];
        for (shards, variables, said) in [
            (None, &again[..], "--shards N"),
            (Some(4), &again[..], "5, and shards are 1 to 4"),
            (Some(4), &[("HQ_TASK_ID", "0")][..], "0, and shards"),
            (Some(4), &[][..], "--shard I/4"),
            (None, &[again[0], ("PARALLEL_SEQ", "1")][..], "inside a task of a Slurm array"),
        ] {
            let message = of(None, shards, variables).unwrap_err().to_string();
            assert!(message.contains(said), "{message}");
        }
    }
}
