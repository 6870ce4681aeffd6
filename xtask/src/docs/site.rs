//! The site: docs as mdBook shows them, with search.

use std::fs;
use std::path::Path;
use std::process::Command;

use super::pages::{INDEX, from_root};
use crate::process::{Outcome, first_line, read, root, run as run_command, target_dir};

/// Builds docs/ into a folder.
pub fn build(site: &Path) -> Outcome {
    if first_line("mdbook", &["--version"]).is_none() {
        return Err("mdbook cannot be run; install it: cargo install mdbook".into());
    }
    let source = target_dir().join("site-source");
    let failed = |cause: std::io::Error| format!("{}: {cause}", source.display());
    if source.exists() {
        fs::remove_dir_all(&source).map_err(failed)?;
    }
    fs::create_dir_all(source.join("docs")).map_err(failed)?;
    fs::copy(root().join("book.toml"), source.join("book.toml")).map_err(failed)?;
    for entry in fs::read_dir(root().join("docs")).map_err(failed)?.flatten() {
        let name = entry.file_name();
        let to = source.join("docs").join(&name);
        if name.to_string_lossy().ends_with(".md") {
            let text = fs::read_to_string(entry.path()).map_err(failed)?;
            fs::write(&to, inside(&text)).map_err(failed)?;
        } else {
            fs::copy(entry.path(), &to).map_err(failed)?;
        }
    }
    fs::write(source.join("docs/SUMMARY.md"), summary(&read(INDEX)?)).map_err(failed)?;
    run_command(Command::new("mdbook").arg("build").arg(&source).arg("--dest-dir").arg(site))?;
    println!("{}", site.join("index.html").display());
    Ok(())
}

/// Text whose links lead to pages of the site alone: what lies outside is named by its path in the project.
fn inside(text: &str) -> String {
    let pattern = regex::Regex::new(r"\[([^\]]*)\]\((\.\./[^)#\s]*)(#[^)\s]*)?\)");
    let Ok(pattern) = pattern else { return text.into() };
    let named = |found: &regex::Captures<'_>| {
        let (words, target) = (&found[1], from_root("docs/page.md", &found[2]));
        let is_named = words.trim_matches('`').ends_with(
            Path::new(&target).file_name().and_then(|it| it.to_str()).unwrap_or(&target),
        );
        if is_named { words.to_owned() } else { format!("{words} (`{target}`)") }
    };
    pattern.replace_all(text, named).into_owned()
}

/// Pages in the order of the index, under its headings, as mdBook expects them.
fn summary(index: &str) -> String {
    let mut summary = String::from("# Summary\n\n[What is where](README.md)\n");
    let mut heading = None;
    for line in index.lines() {
        if line.starts_with("## ") {
            heading = Some(&line[1..]);
        } else if line.starts_with("- [")
            && let Some(end) = line.find(')')
        {
            if let Some(heading) = heading.take() {
                summary.extend(["\n", heading, "\n\n"]);
            }
            summary.extend([&line[..=end], "\n"]);
        }
    }
    summary
}

#[cfg(test)]
mod tests {
    #[test]
    fn summary_has_pages_under_their_headings() {
        let index = "# Docs\n\nSee [x](x.md).\n\n## One\n\n- [A](a.md): first\n- [B](b.md)\n\n## Words\n\n- **word**: [A](a.md)\n";
        assert_eq!(
            super::summary(index),
            "# Summary\n\n[What is where](README.md)\n\n# One\n\n- [A](a.md)\n- [B](b.md)\n"
        );
    }

    #[test]
    fn links_out_of_the_docs_become_paths() {
        let text = "[a](b.md#c), [the scanner](../firmware/src/readout.rs#x), [ARCHITECTURE.md](../ARCHITECTURE.md)";
        assert_eq!(
            super::inside(text),
            "[a](b.md#c), the scanner (`firmware/src/readout.rs`), ARCHITECTURE.md"
        );
    }
}
