//! Paths by which code reaches other modules of its crate.

use proc_macro2::{TokenStream, TokenTree};
use syn::visit::{self, Visit};
use syn::{ImplItem, Item, ItemUse, Macro, Path, Stmt, UseTree, Visibility};

use super::test_code::{is_test, of_impl_item, of_item};

/// A path that begins with `crate`, `self` or `super`, and where it stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mention {
    pub path: Vec<String>,
    /// Whether the path stands for everything in it (`*`).
    pub glob: bool,
    pub line: usize,
}

/// One name that a `use` brings into a module.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Import {
    /// The name in the module; `None` for all names at the path.
    pub name: Option<String>,
    pub path: Vec<String>,
    pub line: usize,
}

/// All names that a `use` brings in, one by one.
pub fn of_use(item: &ItemUse) -> Vec<Import> {
    let mut imports = Vec::new();
    // A path that starts with `::` leads to another crate.
    if item.leading_colon.is_none() {
        flatten(&item.tree, &mut Vec::new(), &mut imports);
    }
    imports
}

fn flatten(tree: &UseTree, before: &mut Vec<String>, imports: &mut Vec<Import>) {
    let mut add = |name: Option<String>, last: Option<&syn::Ident>, line: usize| {
        // The path `a::{self}` is the same as `a`.
        let last = last.filter(|last| **last != "self" || before.is_empty());
        let path: Vec<String> =
            before.iter().cloned().chain(last.map(ToString::to_string)).collect();
        imports.push(Import { name, path, line });
    };
    match tree {
        UseTree::Path(path) => {
            before.push(path.ident.to_string());
            flatten(&path.tree, before, imports);
            before.pop();
        }
        UseTree::Name(name) if name.ident == "self" => {
            let own = before.last().cloned();
            add(own, Some(&name.ident), name.ident.span().start().line);
        }
        UseTree::Name(name) => {
            add(Some(name.ident.to_string()), Some(&name.ident), name.ident.span().start().line);
        }
        UseTree::Rename(rename) => {
            let line = rename.ident.span().start().line;
            add(Some(rename.rename.to_string()), Some(&rename.ident), line);
        }
        UseTree::Glob(glob) => add(None, None, glob.star_token.spans[0].start().line),
        UseTree::Group(group) => {
            group.items.iter().for_each(|tree| flatten(tree, before, imports));
        }
    }
}

/// All paths of `items` that begin with `crate`, `self` or `super`, in `use` and elsewhere. Tests and inner
/// modules are left out.
pub fn mentions(items: &[Item]) -> Vec<Mention> {
    let mut collector = Collector::default();
    items.iter().for_each(|item| collector.visit_item(item));
    collector.0
}

#[derive(Default)]
struct Collector(Vec<Mention>);

impl Collector {
    fn add(&mut self, path: Vec<String>, glob: bool, line: usize) {
        let begins = path.first().is_some_and(|first| is_start(first));
        if begins && (path.len() > 1 || glob) {
            self.0.push(Mention { path, glob, line });
        }
    }

    /// Adds the paths in a macro's arguments, which are not parsed yet: a path is found by its first name.
    fn tokens(&mut self, tokens: TokenStream) {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        let mut at = 0;
        while at < tokens.len() {
            match &tokens[at] {
                TokenTree::Group(group) => self.tokens(group.stream()),
                TokenTree::Ident(first) if is_start(&first.to_string()) => {
                    let mut path = vec![first.to_string()];
                    while let Some(next) = segment(&tokens[at + 1..]) {
                        path.push(next);
                        at += 3;
                    }
                    self.add(path, false, first.span().start().line);
                }
                _ => (),
            }
            at += 1;
        }
    }
}

fn is_start(name: &str) -> bool {
    ["crate", "self", "super"].contains(&name)
}

/// The name behind `::`, if there is one.
fn segment(tokens: &[TokenTree]) -> Option<String> {
    match tokens {
        [TokenTree::Punct(one), TokenTree::Punct(two), TokenTree::Ident(name), ..]
            if one.as_char() == ':' && two.as_char() == ':' =>
        {
            Some(name.to_string())
        }
        _ => None,
    }
}

impl<'ast> Visit<'ast> for Collector {
    fn visit_item(&mut self, item: &'ast Item) {
        if !matches!(item, Item::Mod(_)) && !is_test(of_item(item)) {
            visit::visit_item(self, item);
        }
    }

    fn visit_impl_item(&mut self, item: &'ast ImplItem) {
        if !is_test(of_impl_item(item)) {
            visit::visit_impl_item(self, item);
        }
    }

    fn visit_stmt(&mut self, statement: &'ast Stmt) {
        if !matches!(statement, Stmt::Local(local) if is_test(&local.attrs)) {
            visit::visit_stmt(self, statement);
        }
    }

    fn visit_item_use(&mut self, item: &'ast ItemUse) {
        for import in of_use(item) {
            self.add(import.path, import.name.is_none(), import.line);
        }
    }

    fn visit_path(&mut self, path: &'ast Path) {
        if let (true, Some(first)) = (path.leading_colon.is_none(), path.segments.first()) {
            let line = first.ident.span().start().line;
            self.add(
                path.segments.iter().map(|part| part.ident.to_string()).collect(),
                false,
                line,
            );
        }
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, called: &'ast Macro) {
        self.visit_path(&called.path);
        self.tokens(called.tokens.clone());
    }

    // The path of a visibility is not an import.
    fn visit_visibility(&mut self, _: &'ast Visibility) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(source: &str) -> Vec<(String, usize)> {
        let file = syn::parse_file(source).unwrap();
        let shown = |mention: Mention| {
            let glob = if mention.glob { "::*" } else { "" };
            (mention.path.join("::") + glob, mention.line)
        };
        mentions(&file.items).into_iter().map(shown).collect()
    }

    #[test]
    fn paths_are_found_in_use_in_code_and_in_macros() {
        let source = "use crate::a::{self, B as C, d::*};\n\
            use std::fmt;\n\
            impl super::Trait for S { fn f(x: self::T<crate::u::V>) { super::super::g(); } }\n\
            fn h() { assert_eq!(1, [crate::m::n()][0]); local(self.x); }\n\
            macro_rules! m { () => { $crate::p::q() } }\n";
        let expected = [
            ("crate::a", 1),
            ("crate::a::B", 1),
            ("crate::a::d::*", 1),
            ("super::Trait", 3),
            ("self::T", 3),
            ("crate::u::V", 3),
            ("super::super::g", 3),
            ("crate::m::n", 4),
            ("crate::p::q", 5),
        ];
        assert_eq!(found(source), expected.map(|(path, line)| (path.to_owned(), line)));
    }

    #[test]
    fn tests_visibility_and_inner_modules_are_left_out() {
        let source = "pub(in crate::a) struct S;\n\
            #[cfg(test)] use crate::b::B;\n\
            #[test] fn t() { crate::c::d(); }\n\
            mod inner { use crate::e::F; }\n\
            impl S { #[cfg(test)] fn g() { crate::h::i(); } }\n\
            #[cfg(feature = \"x\")] use crate::j::K;\n";
        assert_eq!(found(source), [("crate::j::K".to_owned(), 6)]);
    }

    #[test]
    fn every_name_of_a_use_is_known_by_the_name_that_it_has() {
        let Item::Use(item) = syn::parse_str("pub use a::{self, b::C as D, e::*};").unwrap() else {
            panic!("a use");
        };
        let names: Vec<_> =
            of_use(&item).into_iter().map(|import| (import.name, import.path.join("::"))).collect();
        let expected = [(Some("a"), "a"), (Some("D"), "a::b::C"), (None, "a::e")];
        assert_eq!(names, expected.map(|(name, path)| (name.map(str::to_owned), path.to_owned())));
    }
}
