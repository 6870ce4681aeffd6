//! The tree of a crate's modules.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use syn::{Attribute, Expr, ExprLit, Item, ItemMod, Lit, Meta};

use super::imports::{Import, Mention, mentions, of_use};
use super::test_code::{is_test, of_item};
use crate::process::Outcome;

/// A module, without code that is compiled for tests only.
#[derive(Debug)]
pub struct Module {
    /// Names of the modules from the crate's root to this one.
    pub path: Vec<String>,
    pub file: PathBuf,
    /// Modules inside this one, in the order of their declaration.
    pub children: Vec<Module>,
    /// Names of items that are defined in the module, except modules.
    pub items: HashSet<String>,
    /// Names that `use` brings into the module.
    pub imports: Vec<Import>,
    /// Paths in the module, with their places.
    pub mentions: Vec<Mention>,
}

/// Function that returns a file's text.
pub type TextOf<'t> = &'t dyn Fn(&Path) -> Outcome<String>;

impl Module {
    /// Reads the modules of the crate that starts with the file `root`.
    ///
    /// # Errors
    /// A file is missing, or cannot be parsed.
    pub fn read(root: &Path, text_of: TextOf<'_>) -> Outcome<Self> {
        let folder = root.parent().unwrap_or(Path::new(""));
        of_file(root, folder, Vec::new(), text_of)
    }

    /// The child module of this name.
    pub fn child(&self, name: &str) -> Option<&Self> {
        self.children.iter().find(|child| child.path.last().is_some_and(|last| last == name))
    }

    /// Place of the child module of this name among its siblings.
    pub fn place(&self, name: &str) -> Option<usize> {
        self.children.iter().position(|child| child.path.last().is_some_and(|last| last == name))
    }

    /// The module at this path, which starts from `self`.
    pub fn at(&self, path: &[String]) -> Option<&Self> {
        path.iter().try_fold(self, |module, name| module.child(name))
    }
}

/// Reads the module in `file`; the files of its inner modules are in `folder`.
fn of_file(file: &Path, folder: &Path, path: Vec<String>, text_of: TextOf<'_>) -> Outcome<Module> {
    let text = text_of(file)?;
    let parsed = syn::parse_file(&text)
        .map_err(|cause| format!("{}:{}: {cause}", file.display(), cause.span().start().line))?;
    of_items(&parsed.items, file, folder, path, text_of)
}

fn of_items(
    items: &[Item],
    file: &Path,
    folder: &Path,
    path: Vec<String>,
    text_of: TextOf<'_>,
) -> Outcome<Module> {
    let mut module = Module {
        path,
        file: file.to_owned(),
        children: Vec::new(),
        items: HashSet::new(),
        imports: Vec::new(),
        mentions: mentions(items),
    };
    for item in items.iter().filter(|item| !is_test(of_item(item))) {
        match item {
            Item::Mod(item) => module.children.push(child(item, &module, folder, text_of)?),
            Item::Use(item) => module.imports.extend(of_use(item)),
            _ => module.items.extend(name(item)),
        }
    }
    Ok(module)
}

fn child(item: &ItemMod, around: &Module, folder: &Path, text_of: TextOf<'_>) -> Outcome<Module> {
    let name = item.ident.to_string();
    let path = around.path.iter().cloned().chain([name.clone()]).collect();
    let below = folder.join(&name);
    if let Some((_, items)) = &item.content {
        return of_items(items, &around.file, &below, path, text_of);
    }
    if let Some(elsewhere) = item.attrs.iter().find_map(path_of) {
        // The path is relative to the folder of the file that declares it.
        let file = around.file.parent().unwrap_or(Path::new("")).join(elsewhere);
        let folder = file.parent().unwrap_or(Path::new("")).to_owned();
        return of_file(&file, &folder, path, text_of);
    }
    let (beside, inside) = (below.with_extension("rs"), below.join("mod.rs"));
    let file = if text_of(&beside).is_ok() { beside } else { inside };
    of_file(&file, &below, path, text_of)
}

/// The file that `#[path = "…"]` names.
fn path_of(attribute: &Attribute) -> Option<String> {
    let Meta::NameValue(pair) = &attribute.meta else { return None };
    match &pair.value {
        Expr::Lit(ExprLit { lit: Lit::Str(path), .. }) if pair.path.is_ident("path") => {
            Some(path.value())
        }
        _ => None,
    }
}

fn name(item: &Item) -> Option<String> {
    Some(match item {
        Item::Const(item) => item.ident.to_string(),
        Item::Enum(item) => item.ident.to_string(),
        Item::Fn(item) => item.sig.ident.to_string(),
        Item::Macro(item) => item.ident.as_ref()?.to_string(),
        Item::Static(item) => item.ident.to_string(),
        Item::Struct(item) => item.ident.to_string(),
        Item::Trait(item) => item.ident.to_string(),
        Item::TraitAlias(item) => item.ident.to_string(),
        Item::Type(item) => item.ident.to_string(),
        Item::Union(item) => item.ident.to_string(),
        _ => return None,
    })
}

#[cfg(test)]
pub mod tests {
    use super::*;

    /// A crate of these files, the first of which is its root.
    pub fn tree(files: &[(&str, &str)]) -> Outcome<Module> {
        let text_of = |file: &Path| {
            let found = files.iter().find(|(name, _)| Path::new(name) == file);
            found.map(|(_, text)| (*text).to_owned()).ok_or(format!("no file {}", file.display()))
        };
        Module::read(Path::new(files[0].0), &text_of)
    }

    #[test]
    fn modules_are_followed_into_their_files() {
        let root = tree(&[
            (
                "src/lib.rs",
                "mod a;\nmod b { mod c; }\n#[path = \"../other/d.rs\"]\nmod d;\n#[cfg(test)]\nmod tests;\n",
            ),
            ("src/a.rs", "mod e;\npub struct S;\nuse e::T as U;\n"),
            ("src/a/e/mod.rs", "mod f;"),
            ("src/a/e/f.rs", ""),
            ("src/b/c.rs", ""),
            ("src/../other/d.rs", "mod g;"),
            ("src/../other/g.rs", ""),
        ])
        .unwrap();
        let names: Vec<_> = root.children.iter().map(|child| child.path.join("::")).collect();
        assert_eq!(names, ["a", "b", "d"]);
        let at = |path: &str| root.at(&path.split("::").map(str::to_owned).collect::<Vec<_>>());
        for path in ["a::e::f", "b::c", "d::g"] {
            assert!(at(path).is_some(), "{path}");
        }
        let a = at("a").unwrap();
        assert!(a.items.contains("S") && a.imports[0].name.as_deref() == Some("U"));
    }

    #[test]
    fn a_module_without_a_file_and_a_file_that_is_no_rust_are_refused() {
        let error = tree(&[("src/lib.rs", "mod a;")]).unwrap_err();
        assert_eq!(error, "no file src/a/mod.rs");
        let error = tree(&[("src/lib.rs", "mod a;"), ("src/a.rs", "fn f() {}\nfn (")]).unwrap_err();
        assert!(error.starts_with("src/a.rs:2: "), "{error}");
    }
}
