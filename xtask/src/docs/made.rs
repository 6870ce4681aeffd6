//! What commands made: figures that pages say, and pictures. `docs/made.toml` lists them by command.

use std::collections::BTreeSet;
use std::env;
use std::fs;
use std::path::PathBuf;
use std::process::Command;
use std::time::Instant;

use serde::Deserialize;
use serde_json::Value;

use super::numbers::{find, like, values};
use super::pages::Page;
use crate::process::{Outcome, capture, cargo, read, root, run as run_command, target_dir};

const LIST: &str = "docs/made.toml";
/// Longest time of a command that runs unasked, in minutes on two cores.
const SHORT_MINUTES: f64 = 0.2;

/// Everything that commands made.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Made {
    /// Pictures of revisions that their pages name.
    kept: Vec<String>,
    run: Vec<Run>,
}

/// Commands that are run together, in an empty folder.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Run {
    name: String,
    /// Time that it takes on two cores.
    minutes: f64,
    /// Day on which it was run last, where it is too slow for every change.
    checked: Option<String>,
    /// Lines of bash: `taxel` is the program, `$ROOT` the project's folder.
    command: String,
    #[serde(default)]
    figure: Vec<Figure>,
    #[serde(default)]
    picture: Vec<Picture>,
}

/// Numbers in a sentence of a page.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Figure {
    page: String,
    /// The page's words, with `{}` for each number.
    says: String,
    /// Where the numbers stand in what the commands print: patterns whose groups are numbers, and pointers into JSON.
    values: Vec<String>,
}

/// Picture of the docs.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Picture {
    file: String,
    /// File that the commands write.
    from: String,
}

impl Made {
    pub fn read() -> Outcome<Self> {
        toml::from_str(&read(LIST)?).map_err(|cause| format!("{LIST}: {cause}"))
    }

    /// Entries that do not fit the pages, and pictures that no command makes.
    pub fn faults(&self, pages: &[Page]) -> Vec<String> {
        let mut faults = Vec::new();
        for run in &self.run {
            if run.minutes > SHORT_MINUTES && run.checked.is_none() {
                faults.push(format!("{LIST}: {}: say in `checked` when it was run", run.name));
            }
            for figure in &run.figure {
                let page = pages.iter().find(|page| page.path == figure.page);
                let found = page.ok_or("there is no such page".into()).and_then(|page| {
                    let found = find(&page.text, &figure.says)?;
                    if found.is_empty() {
                        Err(format!("no number: {}", figure.says))
                    } else {
                        Ok(())
                    }
                });
                faults.extend(
                    found.err().map(|why| format!("{LIST}: {}: {}: {why}", run.name, figure.page)),
                );
            }
        }
        let made = self.run.iter().flat_map(|run| &run.picture).map(|picture| &picture.file);
        let made: BTreeSet<&str> = made.chain(&self.kept).map(String::as_str).collect();
        let shown = pages.iter().filter(|page| page.is_documentation());
        let shown: BTreeSet<&str> =
            shown.flat_map(|page| page.pictures.iter().map(String::as_str)).collect();
        faults
            .extend(shown.difference(&made).map(|file| format!("{LIST}: no command makes {file}")));
        faults.extend(made.difference(&shown).map(|file| format!("{file}: no page shows it")));
        faults
    }

    /// Runs of these names, of which `all` is one; without names, those of seconds.
    pub fn chosen(&self, names: &[String]) -> Outcome<Vec<&Run>> {
        let is_all = names.iter().any(|name| name == "all");
        let is_known = |name: &&String| is_all || self.run.iter().any(|run| run.name == **name);
        if let Some(unknown) = names.iter().find(|name| !is_known(name)) {
            return Err(format!("{LIST} has no run called {unknown}"));
        }
        let is_chosen = |run: &&Run| match names {
            [] => run.minutes <= SHORT_MINUTES,
            names => is_all || names.contains(&run.name),
        };
        Ok(self.run.iter().filter(is_chosen).collect())
    }
}

/// Runs commands again, and compares figures and pictures with those in the docs, or writes them there.
pub fn again(run: &Run, accept: bool) -> Outcome<Vec<String>> {
    let begun = Instant::now();
    let folder = target_dir().join("docs").join(&run.name);
    let failed = |cause: std::io::Error| format!("{}: {cause}", folder.display());
    if folder.exists() {
        fs::remove_dir_all(&folder).map_err(failed)?;
    }
    fs::create_dir_all(&folder).map_err(failed)?;
    let said = capture(
        Command::new("bash")
            .args(["-e", "-c", &run.command])
            .current_dir(&folder)
            .env("ROOT", root())
            .env("PATH", path(run.minutes > SHORT_MINUTES)?),
    );
    said.outcome.map_err(|cause| format!("{}: {cause}\n{}{}", run.name, said.out, said.err))?;
    let json = last_document(&said.out);
    let all = format!("{}\n{}", said.out, said.err);
    let mut faults = Vec::new();
    for figure in &run.figure {
        let compared = figure.compared(&all, json.as_ref(), accept);
        faults.extend(compared.unwrap_or_else(|cause| vec![cause]));
    }
    for picture in &run.picture {
        let (old, new) = (root().join(&picture.file), folder.join(&picture.from));
        let bytes = fs::read(&new).map_err(|cause| format!("{}: {cause}", new.display()))?;
        if fs::read(&old).ok().as_ref() != Some(&bytes) {
            if accept {
                fs::write(&old, bytes).map_err(|cause| format!("{}: {cause}", old.display()))?;
            } else {
                faults.push(format!("{} differs from what {} makes", picture.file, run.name));
            }
        }
    }
    println!(
        "{:20} {:4} sentences, {:2} pictures, {:4.0} s",
        run.name,
        run.figure.len(),
        run.picture.len(),
        begun.elapsed().as_secs_f64()
    );
    Ok(faults.into_iter().map(|fault| format!("{}: {fault}", run.name)).collect())
}

/// Last JSON document in what was printed: only its own bracket begins a line.
fn last_document(out: &str) -> Option<Value> {
    let starts = out.match_indices(['{', '[']).map(|(at, _)| at);
    let mut starts = starts.filter(|at| *at == 0 || out[..*at].ends_with('\n'));
    starts.next_back().and_then(|start| serde_json::from_str(&out[start..]).ok())
}

impl Figure {
    fn compared(&self, said: &str, json: Option<&Value>, accept: bool) -> Outcome<Vec<String>> {
        let text = read(&self.page)?;
        let found = find(&text, &self.says)?;
        let given = self.values.iter().map(|way| values(said, json, way));
        let given = given.collect::<Outcome<Vec<_>>>();
        let given = given.map_err(|cause| format!("{}: {cause}", self.page))?.concat();
        if given.len() != found.len() {
            let counts = format!("{} numbers and {} values", found.len(), given.len());
            return Err(format!("{}: {counts}: {}", self.page, self.says));
        }
        let (mut faults, mut changed) = (Vec::new(), text.clone());
        // From the end on, so that places before stay.
        for ((shown, place), value) in found.into_iter().zip(given).rev() {
            let is = like(shown, value);
            if is != shown {
                changed.replace_range(place, &is);
                if !accept {
                    faults
                        .push(format!("{} says {shown}, and it is {is}: {}", self.page, self.says));
                }
            }
        }
        if accept && changed != text {
            fs::write(root().join(&self.page), changed)
                .map_err(|cause| format!("{}: {cause}", self.page))?;
        }
        Ok(faults)
    }
}

/// Search path with the program, which is built if need be: for short runs as tests are.
fn path(is_long: bool) -> Outcome<std::ffi::OsString> {
    let profile = if is_long { "release" } else { "dev" };
    run_command(&mut cargo(&["build", "--quiet", "--package", "host-sim", "--profile", profile]))?;
    let own = env::split_paths(&env::var_os("PATH").unwrap_or_default()).collect::<Vec<PathBuf>>();
    let built = target_dir().join(if is_long { "release" } else { "debug" });
    env::join_paths([built].into_iter().chain(own)).map_err(|cause| cause.to_string())
}
