//! Pages, and what their links and pictures lead to.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};

use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd};

use crate::process::{Outcome, capture, read, root};

/// Page of the project, in Markdown.
pub struct Page {
    /// Path from the project's root.
    pub path: String,
    pub text: String,
    /// Targets of links, as they are written.
    pub links: Vec<String>,
    /// Paths of pictures from the project's root.
    pub pictures: Vec<String>,
    /// Anchors of headings.
    anchors: BTreeSet<String>,
}

impl Page {
    /// All pages that git knows, or would know.
    pub fn all() -> Outcome<Vec<Self>> {
        let mut list = std::process::Command::new("git");
        list.args(["ls-files", "--cached", "--others", "--exclude-standard", "*.md"]);
        let said = capture(list.current_dir(root()));
        said.outcome.map_err(|cause| said.err + &cause)?;
        let there = said.out.lines().filter(|path| root().join(path).is_file());
        there.map(|path| Ok(Self::new(path, read(path)?))).collect()
    }

    fn new(path: &str, text: String) -> Self {
        let (mut links, mut pictures, mut anchors) = (Vec::new(), Vec::new(), BTreeSet::new());
        let mut heading: Option<String> = None;
        let mut seen: BTreeMap<String, usize> = BTreeMap::new();
        for event in Parser::new_ext(&text, Options::ENABLE_TABLES) {
            match event {
                Event::Start(Tag::Link { dest_url, .. }) => links.push(dest_url.into_string()),
                Event::Start(Tag::Image { dest_url, .. }) => {
                    pictures.push(from_root(path, &dest_url));
                    links.push(dest_url.into_string());
                }
                Event::Start(Tag::Heading { .. }) => heading = Some(String::new()),
                Event::End(TagEnd::Heading(_)) => {
                    let anchor = anchor(&heading.take().unwrap_or_default());
                    let count = seen.entry(anchor.clone()).or_insert(0);
                    *count += 1;
                    let again = if *count > 1 { format!("-{}", *count - 1) } else { String::new() };
                    anchors.insert(anchor + &again);
                }
                Event::Text(text) | Event::Code(text) => {
                    if let Some(heading) = &mut heading {
                        heading.push_str(&text);
                    }
                }
                _ => {}
            }
        }
        Self { path: path.into(), text, links, pictures, anchors }
    }

    /// Whether its words count: README and docs.
    pub fn is_documentation(&self) -> bool {
        self.path == "README.md" || self.path.starts_with("docs/")
    }
}

/// Anchor of a heading, as mdBook and GitHub make it.
fn anchor(heading: &str) -> String {
    let kept = heading.trim().chars().filter_map(|letter| match letter {
        ' ' => Some('-'),
        '-' | '_' => Some(letter),
        _ => letter.is_alphanumeric().then_some(letter),
    });
    kept.collect::<String>().to_lowercase()
}

/// Path from the project's root of what `target` names on the page at `path`.
pub fn from_root(path: &str, target: &str) -> String {
    let folder = Path::new(path).parent().unwrap_or(Path::new(""));
    let mut plain = PathBuf::new();
    for part in folder.join(target).components() {
        match part {
            Component::ParentDir => {
                plain.pop();
            }
            Component::CurDir => {}
            other => plain.push(other),
        }
    }
    plain.to_string_lossy().into_owned()
}

/// Number of links of all pages.
pub fn link_count(pages: &[Page]) -> usize {
    pages.iter().map(|page| page.links.len()).sum()
}

/// Links that lead nowhere, and pages that the index lacks.
pub fn faults(pages: &[Page]) -> Vec<String> {
    let by_path: BTreeMap<&str, &Page> =
        pages.iter().map(|page| (page.path.as_str(), page)).collect();
    let mut faults = Vec::new();
    for page in pages {
        for link in page.links.iter().filter(|link| !link.contains("://")) {
            let (target, anchor) = link.split_once('#').unwrap_or((link, ""));
            let target =
                if target.is_empty() { page.path.clone() } else { from_root(&page.path, target) };
            if !by_path.contains_key(target.as_str()) && !root().join(&target).exists() {
                faults.push(format!("{}: {link}: there is no {target}", page.path));
            } else if !anchor.is_empty()
                && by_path.get(target.as_str()).is_some_and(|it| !it.anchors.contains(anchor))
            {
                faults.push(format!("{}: {link}: {target} has no such heading", page.path));
            }
        }
    }
    let listed = by_path.get(INDEX).map_or(&[][..], |page| &page.links);
    let listed: BTreeSet<String> = listed.iter().map(|link| from_root(INDEX, link)).collect();
    let of_docs = pages.iter().map(|page| &page.path).filter(|path| path.starts_with("docs/"));
    faults.extend(
        of_docs
            .filter(|path| *path != INDEX && !listed.contains(*path))
            .map(|path| format!("{INDEX}: it lacks {path}")),
    );
    faults
}

/// Index of the docs, whose order the site has.
pub const INDEX: &str = "docs/README.md";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_and_anchors_are_found_and_what_leads_nowhere_is_named() {
        let page = Page::new(
            INDEX,
            "# A `b`: c, d\n\n[1](../README.md#taxel) [2](#a-b-c-d) [3](#e)\n![4](none.svg)\n\n```\n[5](code.md)\n```\n".into(),
        );
        assert_eq!(page.links, ["../README.md#taxel", "#a-b-c-d", "#e", "none.svg"]);
        assert_eq!(page.pictures, ["docs/none.svg"]);
        let readme = Page::new("README.md", "# Taxel\n".into());
        let faults = faults(&[readme, page]);
        assert_eq!(faults.len(), 2, "{faults:?}");
        assert!(faults[0].contains("#e") && faults[1].contains("none.svg"), "{faults:?}");
    }
}
