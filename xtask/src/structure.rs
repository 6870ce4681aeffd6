//! Checks of the code against the rules in ARCHITECTURE.md: which module and which crate may import which, where
//! `unsafe` may stand, and how large a crate may be. The module `house` declares the rules' values.

mod house;
mod workspace;

mod crates;
mod shares;

mod test_code;

mod imports;
mod modules;
mod order;
mod unsafe_code;

use std::fs;
use std::path::Path;

use crate::process::{Outcome, root};
use modules::Module;
use workspace::Package;

/// Checks every rule, prints the results, and fails if a rule is broken.
pub fn run() -> Outcome {
    let packages = workspace::packages()?;
    let mut broken = crates::broken(&packages, house::CRATES);
    let absent = crates::absent(&packages, house::CRATES);
    if !absent.is_empty() {
        println!("declared, but not there: {}", absent.join(", "));
    }
    broken.extend(module_order(&packages)?);
    let sources = workspace::sources()?;
    let mut lines = Vec::new();
    for source in &sources {
        let text = text_of(source)?;
        broken.extend(unsafe_code::broken(source, &text, house::UNSAFE)?);
        lines.push((source.as_path(), text.lines().count()));
    }
    let shares = shares::of(&packages, &lines);
    print!("{}", shares::table(&shares));
    let too_large = shares::too_large(&shares, house::LARGEST_SHARE_PERCENT);
    if house::SHARES_MUST_HOLD {
        broken.extend(too_large);
    } else {
        too_large.iter().for_each(|message| println!("not yet held to: {message}"));
    }
    if broken.is_empty() {
        println!("{} crates and {} files stand as declared", packages.len(), sources.len());
        return Ok(());
    }
    broken.iter().for_each(|message| println!("{message}"));
    Err(format!("{} breaches of the rules in ARCHITECTURE.md", broken.len()))
}

/// Breaches of the order of modules. For crates that are not in order yet, only their number is printed.
fn module_order(packages: &[Package]) -> Outcome<Vec<String>> {
    let mut broken = Vec::new();
    for package in packages {
        let (mut breaches, mut advice) = (Vec::new(), Vec::new());
        for file in &package.roots {
            let found = order::broken(&Module::read(file, &text_of)?);
            breaches.extend(found.breaches);
            advice.extend(found.advice);
        }
        if house::NOT_YET_IN_ORDER.contains(&package.name.as_str()) {
            match breaches.len() {
                0 => println!("{}: in order; take it off NOT_YET_IN_ORDER", package.name),
                count => println!("{}: not yet in order, {count} breaches", package.name),
            }
        } else {
            broken.extend(breaches);
            advice.iter().for_each(|advice| println!("{advice}"));
        }
    }
    Ok(broken)
}

fn text_of(file: &Path) -> Outcome<String> {
    fs::read_to_string(root().join(file)).map_err(|cause| format!("{}: {cause}", file.display()))
}
