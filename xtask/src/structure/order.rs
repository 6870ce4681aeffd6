//! The rule for modules: siblings are declared from the ground up, and a module imports only from siblings
//! declared before it, at the level where the two paths part. So nothing imports in a circle.
//!
//! A module may use whatever its ancestors define themselves. A name that they only pass on by `use` is followed
//! to its definition.

use super::modules::Module;

/// Largest number of `use` through which a name is followed.
const LONGEST_CHAIN: usize = 16;

/// Target of a path, seen from a module.
#[derive(Debug, PartialEq, Eq)]
enum Target {
    /// The module itself, something inside it, another crate, or an item that an ancestor defines.
    Free,
    /// A child module of an ancestor: the ancestor's path, and the child's name.
    Sibling(Vec<String>, String),
    /// An ancestor as a whole.
    Ancestor(Vec<String>),
}

/// An import between two child modules of one module.
struct Edge<'m> {
    parent: &'m Module,
    from: usize,
    to: usize,
}

/// Description of the breaches in a crate.
#[derive(Debug, PartialEq, Eq)]
pub struct Disorder {
    pub breaches: Vec<String>,
    /// For each module whose children break the order, an order that would not.
    pub advice: Vec<String>,
}

/// Finds every breach in the crate.
pub fn broken(root: &Module) -> Disorder {
    let (mut broken, mut edges) = (Vec::new(), Vec::new());
    visit(root, root, &mut broken, &mut edges);
    let mut parents: Vec<&Module> = Vec::new();
    for edge in edges.iter().filter(|edge| edge.to > edge.from) {
        if !parents.iter().any(|parent| parent.path == edge.parent.path) {
            parents.push(edge.parent);
        }
    }
    let advice = parents.into_iter().map(|parent| advice(parent, &edges)).collect();
    Disorder { breaches: broken, advice }
}

fn visit<'m>(
    root: &'m Module,
    module: &'m Module,
    broken: &mut Vec<String>,
    edges: &mut Vec<Edge<'m>>,
) {
    for mention in &module.mentions {
        let Some(path) = absolute(module, &mention.path) else { continue };
        let place = || format!("{}:{}: ", module.file.display(), mention.line);
        let import = || mention.path.join("::") + if mention.glob { "::*" } else { "" };
        match target(root, module, &path, 0) {
            Target::Free => (),
            Target::Ancestor(_) => broken.push(format!(
                "{}{} imports `{}`, which is all of a module around it: name what is meant",
                place(),
                shown(&module.path),
                import()
            )),
            Target::Sibling(parent, name) => {
                let own = &module.path[parent.len()];
                let Some(parent) = root.at(&parent) else { continue };
                let (Some(from), Some(to)) = (parent.place(own), parent.place(&name)) else {
                    continue;
                };
                if to > from {
                    broken.push(format!(
                        "{}{} imports `{}`, but {} declares `{name}` after `{own}`",
                        place(),
                        shown(&module.path),
                        import(),
                        parent.file.display()
                    ));
                }
                edges.push(Edge { parent, from, to });
            }
        }
    }
    module.children.iter().for_each(|child| visit(root, child, broken, edges));
}

fn shown(path: &[String]) -> String {
    if path.is_empty() { "the crate's root".into() } else { format!("`{}`", path.join("::")) }
}

/// The path from the crate's root; `None` if it leads out of the crate, or above its root.
fn absolute(module: &Module, path: &[String]) -> Option<Vec<String>> {
    let (first, rest) = path.split_first()?;
    match first.as_str() {
        "crate" => Some(rest.to_vec()),
        "self" => Some([&module.path, rest].concat()),
        "super" => {
            let above = path.iter().take_while(|name| *name == "super").count();
            let kept = module.path.len().checked_sub(above)?;
            Some([&module.path[..kept], &path[above..]].concat())
        }
        first if module.child(first).is_some() => Some([&module.path, path].concat()),
        _ => None,
    }
}

fn target(root: &Module, from: &Module, path: &[String], depth: usize) -> Target {
    let shared = from.path.iter().zip(path).take_while(|(own, other)| own == other).count();
    if shared == from.path.len() || depth > LONGEST_CHAIN {
        return Target::Free;
    }
    let ancestor = &from.path[..shared];
    let Some(name) = path.get(shared) else { return Target::Ancestor(ancestor.to_vec()) };
    let Some(around) = root.at(ancestor) else { return Target::Free };
    if around.child(name).is_some() {
        return Target::Sibling(ancestor.to_vec(), name.clone());
    }
    if around.items.contains(name) {
        return Target::Free;
    }
    let onward = |start: &[String], rest: &[String]| {
        let start = absolute(around, start)?;
        Some(target(root, from, &[&start, rest].concat(), depth + 1))
    };
    let mut named = around.imports.iter().filter(|import| import.name.as_ref() == Some(name));
    if let Some(found) = named.find_map(|import| onward(&import.path, &path[shared + 1..])) {
        return found;
    }
    let globs = around.imports.iter().filter(|import| import.name.is_none());
    let mut of_globs = globs.filter_map(|import| {
        let module = root.at(&absolute(around, &import.path)?)?;
        let passed_on = module.imports.iter().any(|import| import.name.as_ref() == Some(name));
        let has = module.items.contains(name) || module.child(name).is_some() || passed_on;
        if has { onward(&import.path, &path[shared..]) } else { None }
    });
    of_globs.next().unwrap_or(Target::Free)
}

/// An order of the modules in `parent` without breaches, or the modules that import in a circle.
fn advice(parent: &Module, edges: &[Edge<'_>]) -> String {
    let name = |index: usize| parent.children[index].path.last().map_or("", String::as_str);
    let edges: Vec<(usize, usize)> = edges
        .iter()
        .filter(|edge| edge.parent.path == parent.path && edge.from != edge.to)
        .map(|edge| (edge.from, edge.to))
        .collect();
    let mut left: Vec<usize> = (0..parent.children.len()).collect();
    let mut order = Vec::new();
    // Always taking the first module that needs none of the rest keeps modules near their places.
    while let Some(at) = left
        .iter()
        .position(|module| !edges.iter().any(|(from, to)| from == module && left.contains(to)))
    {
        order.push(left.remove(at));
    }
    let names =
        |indices: &[usize]| indices.iter().map(|index| name(*index)).collect::<Vec<_>>().join(", ");
    if left.is_empty() {
        return format!("{}: this order would do: {}", parent.file.display(), names(&order));
    }
    // A module that no other of the circle needs is not part of the circle.
    while let Some(at) = left
        .iter()
        .position(|module| !edges.iter().any(|(from, to)| to == module && left.contains(from)))
    {
        left.remove(at);
    }
    format!(
        "{}: no order would do, these import in a circle: {}",
        parent.file.display(),
        names(&left)
    )
}

#[cfg(test)]
mod tests {
    use super::super::modules::tests::tree;
    use super::Disorder;

    fn broken(files: &[(&str, &str)]) -> Vec<String> {
        let Disorder { breaches, advice } = super::broken(&tree(files).unwrap());
        [breaches, advice].concat()
    }

    #[test]
    fn a_module_may_import_what_is_declared_before_it_and_what_its_ancestors_define() {
        let files = [
            (
                "lib.rs",
                "mod ground { pub struct G; }\nmod house;\nmod roof;\npub struct Own;\nuse roof::R;",
            ),
            ("house.rs", "mod low;\nmod high;\npub struct H;\nuse high::X;"),
            (
                "house/low.rs",
                "use crate::ground::G;\nuse super::H;\nuse crate::Own;\nuse std::fmt;",
            ),
            ("house/high.rs", "pub struct X(super::low::L);\nfn f() { crate::ground::g() }"),
            ("roof.rs", "use crate::house::{self, H};\nuse super::ground;"),
        ];
        assert_eq!(broken(&files), <[&str; 0]>::default());
    }

    #[test]
    fn an_import_of_what_is_declared_later_is_named_with_its_place() {
        let files = [
            ("src/lib.rs", "mod roof;\nmod ground;"),
            ("src/roof.rs", "mod tile;"),
            ("src/roof/tile.rs", "\nuse crate::ground::G;"),
            ("src/ground.rs", ""),
        ];
        assert_eq!(
            broken(&files),
            [
                "src/roof/tile.rs:2: `roof::tile` imports `crate::ground::G`, but src/lib.rs declares \
                 `ground` after `roof`",
                "src/lib.rs: this order would do: ground, roof"
            ]
        );
    }

    #[test]
    fn paths_in_code_and_in_macros_count_as_imports() {
        for code in ["fn f() { super::b::g(); }", "fn f() { assert!(crate::b::g()); }"] {
            let found = broken(&[("lib.rs", "mod a;\nmod b;"), ("a.rs", code), ("b.rs", "")]);
            assert!(found[0].contains("`a` imports `"), "{found:?}");
        }
    }

    #[test]
    fn a_circle_is_found_and_named_without_what_stands_on_it_or_under_it() {
        let root = "mod ground { }\n\
            mod a { use super::{b::B, ground::G}; }\n\
            mod b { use super::a::A; }\n\
            mod on_it { use super::b::B; }";
        assert_eq!(
            broken(&[("lib.rs", root)]),
            [
                "lib.rs:2: `a` imports `super::b::B`, but lib.rs declares `b` after `a`",
                "lib.rs: no order would do, these import in a circle: a, b"
            ]
        );
    }

    #[test]
    fn what_an_ancestor_only_passes_on_is_followed_to_where_it_is_defined() {
        for passing in ["pub use b::B;", "use b::Other as B;", "pub use b::*;", "use crate::b::B;"]
        {
            let root = format!("mod a {{ use super::B; }}\nmod b {{ pub struct B; }}\n{passing}");
            let found = broken(&[("lib.rs", &root)]);
            assert_eq!(
                found[0],
                "lib.rs:1: `a` imports `super::B`, but lib.rs declares `b` after `a`"
            );
            let root = format!("mod b {{ pub struct B; }}\nmod a {{ use super::B; }}\n{passing}");
            assert!(broken(&[("lib.rs", &root)]).is_empty());
        }
    }

    #[test]
    fn everything_of_a_module_around_is_too_much_to_import_but_in_tests() {
        let root = "mod b;\nmod a { use super::*; }";
        let found = broken(&[("lib.rs", root), ("b.rs", "")]);
        assert!(
            found[0].starts_with("lib.rs:2: `a` imports `super::*`, which is all of"),
            "{found:?}"
        );
        let root = "mod b;\n#[cfg(test)]\nmod tests { use super::*; }";
        assert!(broken(&[("lib.rs", root), ("b.rs", "")]).is_empty());
    }
}
