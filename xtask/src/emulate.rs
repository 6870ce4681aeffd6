//! Running the emulator's programs and comparing each with its expected output, and the application with the host.
//! Two run at a time; results are printed in order.

mod application;
mod expected;
pub mod qemu;

use std::fs;
use std::path::{Path, PathBuf};

use crate::images::{QEMU, build_image};
use crate::process::{Outcome, Said, root, two_at_a_time};
use crate::toolchain::{Toolchain, elf};

/// Name of the application among the programs.
const APPLICATION: &str = "application";

/// What to run.
#[derive(clap::Args)]
pub struct Options {
    /// Write the .out files instead of comparing.
    #[arg(long)]
    accept: bool,
    /// Programs to run; all if there are none. `application` is compared with the host. Their logs are printed.
    #[arg(value_name = "NAME")]
    names: Vec<String>,
}

/// Runs the programs of these names, or all and the application, and compares their logs with the expected ones.
/// Prints the logs of programs that were named.
pub fn run(options: &Options) -> Outcome {
    let all = programs(&root().join("firmware/qemu/src/bin"))?;
    let (application, names): (Vec<&str>, Vec<&str>) =
        options.names.iter().map(|name| &**name).partition(|name| *name == APPLICATION);
    let everything = application.is_empty() && names.is_empty();
    let chosen = if application.is_empty() || !names.is_empty() {
        choose(&all, &names)?
    } else {
        Vec::new()
    };
    qemu::present()?;
    build_image(&Toolchain::find()?, QEMU)?;

    let (mut jobs, mut failed) = (Vec::new(), Vec::new());
    if everything || !application.is_empty() {
        match application::checks() {
            // These checks come first, since they take longest.
            Ok(checks) => jobs.extend(checks.map(Job::Application)),
            Err(cause) => conclude(APPLICATION, Err(cause), &mut failed),
        }
    }
    jobs.extend(chosen.into_iter().map(Job::Program));
    let work = |job: &Job| match job {
        Job::Program(program) => run_program(program, options.accept, !names.is_empty()),
        Job::Application(check) => check.run(),
    };
    for (job, said) in jobs.iter().zip(two_at_a_time(&jobs, work)?) {
        eprint!("{}", said.err);
        print!("{}", said.out);
        conclude(&job.name(), said.outcome, &mut failed);
    }
    if jobs.iter().any(|job| matches!(job, Job::Application(_))) {
        println!("the application's log: cargo xtask log {}", application::log().display());
    }
    if failed.is_empty() {
        Ok(())
    } else {
        let failed = failed.join(", ");
        Err(format!(
            "{failed}; if a program's log is meant to differ, cargo xtask emulate --accept"
        ))
    }
}

/// One thing to run.
enum Job {
    /// The source of a program.
    Program(PathBuf),
    Application(application::Check),
}

impl Job {
    fn name(&self) -> String {
        match self {
            Self::Program(program) => name(program),
            Self::Application(check) => check.name.to_owned(),
        }
    }
}

/// Prints how `name` ended.
fn conclude(name: &str, outcome: Outcome, failed: &mut Vec<String>) {
    match outcome {
        Ok(()) => println!("ok      {name}"),
        Err(cause) => {
            println!("FAILED  {name}: {cause}");
            failed.push(name.to_owned());
        }
    }
}

fn run_program(program: &Path, accept: bool, show: bool) -> Said {
    match qemu::run(&elf(&name(program))) {
        Ok(ended) => Said {
            outcome: check(program, &ended.log, accept),
            out: if show { ended.log } else { String::new() },
            err: ended.complaints,
        },
        Err(cause) => Said { out: String::new(), err: String::new(), outcome: Err(cause) },
    }
}

/// Prints a log that was saved while an image ran; without `image`, it is the application's log.
pub fn print_log(log: &str, image: Option<&str>) -> Outcome {
    let image = image.map_or_else(|| elf(application::IMAGE), PathBuf::from);
    let text = qemu::decoded(Path::new(log), &image)?;
    if text.is_empty() {
        return Err(format!("{log} holds no log of {}", image.display()));
    }
    print!("{text}");
    Ok(())
}

fn check(program: &Path, output: &str, accept: bool) -> Outcome {
    let beside = program.with_extension("out");
    if accept {
        return fs::write(&beside, output)
            .map_err(|cause| format!("{}: {cause}", beside.display()));
    }
    let expected =
        fs::read_to_string(&beside).map_err(|cause| format!("{}: {cause}", beside.display()))?;
    expected::compare(&expected, output)
}

/// Sources of all programs, sorted by name.
fn programs(directory: &Path) -> Outcome<Vec<PathBuf>> {
    let entries =
        fs::read_dir(directory).map_err(|cause| format!("{}: {cause}", directory.display()))?;
    let mut programs: Vec<_> = entries
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "rs"))
        .collect();
    programs.sort();
    Ok(programs)
}

fn name(program: &Path) -> String {
    program.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// The programs of these names; all if no name is given.
fn choose(all: &[PathBuf], names: &[&str]) -> Outcome<Vec<PathBuf>> {
    if names.is_empty() {
        return Ok(all.to_vec());
    }
    let find = |wanted: &&str| {
        all.iter().find(|program| name(program) == **wanted).cloned().ok_or_else(|| {
            let all: Vec<_> = all.iter().map(|program| name(program)).collect();
            format!("there is no program `{wanted}`, but {APPLICATION}, {}", all.join(", "))
        })
    };
    names.iter().map(find).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn programs_and_expected_outputs_come_in_pairs() {
        let directory = root().join("firmware/qemu/src/bin");
        let programs = programs(&directory).unwrap();
        assert!(!programs.is_empty());
        let mut outputs: Vec<_> = fs::read_dir(&directory)
            .unwrap()
            .map(|entry| entry.unwrap().path())
            .filter(|path| path.extension().is_some_and(|extension| extension == "out"))
            .collect();
        outputs.sort();
        let expected: Vec<_> = programs.iter().map(|path| path.with_extension("out")).collect();
        assert_eq!(outputs, expected);
    }

    #[test]
    fn programs_are_chosen_by_name() {
        let all = [PathBuf::from("bin/hello.rs"), PathBuf::from("bin/panic.rs")];
        assert_eq!(choose(&all, &[]).unwrap(), all);
        assert_eq!(choose(&all, &["panic"]).unwrap(), all[1..]);
        let error = choose(&all, &["panic", "helo"]).unwrap_err();
        assert_eq!(error, "there is no program `helo`, but application, hello, panic");
    }
}
