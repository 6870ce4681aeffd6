//! The rule for `unsafe`: it stands only in declared files, and a comment says why it is sound.

use std::path::Path;

use proc_macro2::{Delimiter, LineColumn, TokenStream, TokenTree};
use syn::spanned::Spanned;
use syn::visit::{self, Visit};
use syn::{
    Attribute, Expr, ExprLit, ForeignItemFn, ImplItem, ItemFn, ItemImpl, Lit, Meta, Signature,
};
use syn::{Stmt, TraitItemFn};

use crate::process::Outcome;

/// Start of the comment that must stand directly before an unsafe block.
const REASON: &str = "// SAFETY:";

/// Section that the documentation of an unsafe function must have.
const SECTION: &str = "# Safety";

/// Descriptions of the breaches in one file; `allowed` are the files and folders in which `unsafe` may stand.
///
/// # Errors
/// The file cannot be parsed.
pub fn broken(file: &Path, text: &str, allowed: &[&str]) -> Outcome<Vec<String>> {
    let failed = |cause: &dyn ToString, line: usize| {
        format!("{}:{line}: {}", file.display(), cause.to_string())
    };
    // The compiler reports text that is not Rust, if it is compiled at all.
    let parsed =
        syn::parse_file(text).map_err(|cause| failed(&cause, cause.span().start().line))?;
    let tokens: TokenStream = text
        .parse()
        .map_err(|cause: proc_macro2::LexError| failed(&cause, cause.span().start().line))?;
    let mut words = Vec::new();
    find(tokens, &mut words);
    let is_allowed = allowed.iter().any(|place| file.starts_with(place));
    if !is_allowed {
        let message = "`unsafe` may not stand here; xtask/src/structure/house.rs has where it may";
        return Ok(words.iter().map(|word| failed(&message, word.at.line)).collect());
    }
    let mut found = Found::default();
    found.visit_file(&parsed);
    let lines: Vec<&str> = text.lines().collect();
    let mut broken: Vec<(usize, String)> = Vec::new();
    for word in words.iter().filter(|word| word.needs_reason) {
        let statement = found.innermost_statement(word.at);
        if ![Some(word.at.line), statement]
            .into_iter()
            .flatten()
            .any(|line| has_reason(&lines, line))
        {
            let message = format!("no `{REASON}` directly before what is unsafe");
            broken.push((word.at.line, message));
        }
    }
    for (name, line) in found.undocumented {
        broken
            .push((line, format!("`{name}` is unsafe, and its documentation has no `{SECTION}`")));
    }
    broken.sort();
    Ok(broken.into_iter().map(|(line, message)| failed(&message, line)).collect())
}

/// One occurrence of the word `unsafe`.
struct Word {
    at: LineColumn,
    /// Whether it starts a block or an implementation, which need a reason.
    needs_reason: bool,
}

fn find(tokens: TokenStream, words: &mut Vec<Word>) {
    let mut tokens = tokens.into_iter().peekable();
    while let Some(token) = tokens.next() {
        match token {
            TokenTree::Group(group) => find(group.stream(), words),
            TokenTree::Ident(word) if word == "unsafe" => {
                let needs_reason = match tokens.peek() {
                    Some(TokenTree::Group(group)) => group.delimiter() == Delimiter::Brace,
                    Some(TokenTree::Ident(next)) => next == "impl",
                    _ => false,
                };
                words.push(Word { at: word.span().start(), needs_reason });
            }
            _ => (),
        }
    }
}

/// Whether the comment that ends directly above `line`, counted from one, has a reason.
fn has_reason(lines: &[&str], line: usize) -> bool {
    let above = lines.iter().take(line.saturating_sub(1)).rev().map(|line| line.trim_start());
    above.take_while(|line| line.starts_with("//")).any(|line| line.starts_with(REASON))
}

/// Statements and unsafe functions found in the file.
#[derive(Default)]
struct Found {
    /// Start and end of each statement.
    statements: Vec<(LineColumn, LineColumn)>,
    /// Unsafe functions without the section, and their lines.
    undocumented: Vec<(String, usize)>,
}

impl Found {
    /// The first line of the innermost statement around.
    fn innermost_statement(&self, at: LineColumn) -> Option<usize> {
        let around = self.statements.iter().filter(|(start, end)| *start <= at && at < *end);
        around.map(|(start, _)| *start).max().map(|start| start.line)
    }

    fn function(&mut self, attributes: &[Attribute], signature: &Signature) {
        if signature.unsafety.is_some() && !attributes.iter().any(has_section) {
            let line = signature.ident.span().start().line;
            self.undocumented.push((signature.ident.to_string(), line));
        }
    }
}

fn has_section(attribute: &Attribute) -> bool {
    let Meta::NameValue(pair) = &attribute.meta else { return false };
    match &pair.value {
        Expr::Lit(ExprLit { lit: Lit::Str(text), .. }) if pair.path.is_ident("doc") => {
            text.value().lines().any(|line| line.trim() == SECTION)
        }
        _ => false,
    }
}

impl<'ast> Visit<'ast> for Found {
    fn visit_stmt(&mut self, statement: &'ast Stmt) {
        let span = statement.span();
        self.statements.push((span.start(), span.end()));
        visit::visit_stmt(self, statement);
    }

    fn visit_item_fn(&mut self, function: &'ast ItemFn) {
        self.function(&function.attrs, &function.sig);
        visit::visit_item_fn(self, function);
    }

    fn visit_item_impl(&mut self, implementation: &'ast ItemImpl) {
        // The safety section of a trait's function is in the trait.
        if implementation.trait_.is_none() {
            for item in &implementation.items {
                if let ImplItem::Fn(function) = item {
                    self.function(&function.attrs, &function.sig);
                }
            }
        }
        visit::visit_item_impl(self, implementation);
    }

    fn visit_trait_item_fn(&mut self, function: &'ast TraitItemFn) {
        self.function(&function.attrs, &function.sig);
        visit::visit_trait_item_fn(self, function);
    }

    fn visit_foreign_item_fn(&mut self, function: &'ast ForeignItemFn) {
        self.function(&function.attrs, &function.sig);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(file: &str, text: &str) -> Vec<String> {
        broken(Path::new(file), text, &["image/src", "core/assembly.rs"]).unwrap()
    }

    #[test]
    fn unsafe_outside_its_places_is_refused_wherever_it_stands() {
        for text in [
            "// SAFETY: none.\nconst X: u8 = unsafe { g() };",
            "/// # Safety\nunsafe fn f() {}",
            "// SAFETY: none.\nunsafe impl Send for S {}",
            "struct S;\nmacro_rules! m { () => { unsafe { g() } } }",
            "struct S;\n#[unsafe(no_mangle)] fn f() {}",
        ] {
            let message =
                "`unsafe` may not stand here; xtask/src/structure/house.rs has where it may";
            assert_eq!(found("core/other.rs", text), [format!("core/other.rs:2: {message}")]);
        }
        let word_alone = "// unsafe\n#![forbid(unsafe_code)]\nconst S: &str = \"unsafe\";";
        assert_eq!(found("core/other.rs", word_alone), <[&str; 0]>::default());
    }

    #[test]
    fn unsafe_in_its_places_with_its_reasons_is_let_pass() {
        let text = "\
            fn f() {\n\
                // SAFETY: nobody else has it,\n\
                // not even later.\n\
                let x =\n\
                    unsafe { g() };\n\
                h(|w| {\n\
                    // SAFETY: any value will do.\n\
                    unsafe { w.bits(1) }\n\
                });\n\
            }\n\
            // SAFETY: it holds numbers.\n\
            unsafe impl Send for S {}\n\
            /// Does it.\n\
            ///\n\
            /// # Safety\n\
            /// `x` is whole.\n\
            pub unsafe fn i() {}\n\
            #[unsafe(no_mangle)]\n\
            fn j() {}\n\
            unsafe extern \"C\" { fn k(); }\n\
            impl T for S { unsafe fn l() {} }\n";
        for file in ["image/src/main.rs", "image/src/deep/er.rs", "core/assembly.rs"] {
            assert_eq!(found(file, text), <[&str; 0]>::default());
        }
    }

    #[test]
    fn a_block_without_a_reason_directly_before_it_is_refused() {
        for (text, line) in [
            ("fn f() {\n    unsafe { g() }\n}", 2),
            ("fn f() {\n    unsafe { g() } // SAFETY: too late\n}", 2),
            ("fn f() { // SAFETY: of something else\n    unsafe { g() }\n}", 2),
            ("// SAFETY: far away\nfn f() {\n    unsafe { g() }\n}", 3),
            ("fn f() { h(unsafe { g() }) }", 1),
            ("// SAFETY\nunsafe impl Send for S {}", 2),
            ("macro_rules! m { () => { unsafe { g() } } }", 1),
        ] {
            let message = "no `// SAFETY:` directly before what is unsafe";
            let expected = format!("image/src/main.rs:{line}: {message}");
            assert_eq!(found("image/src/main.rs", text), [expected]);
        }
    }

    #[test]
    fn an_unsafe_function_that_asks_for_nothing_in_words_is_refused() {
        let expected = |line| {
            format!("image/src/a.rs:{line}: `f` is unsafe, and its documentation has no `# Safety`")
        };
        for (text, line) in [
            ("unsafe fn f() {}", 1),
            ("impl S {\n    /// Safety: none.\n    pub const unsafe fn f() {}\n}", 3),
            ("trait T {\n    unsafe fn f();\n}", 2),
            ("unsafe extern \"C\" {\n    /// Foreign.\n    pub unsafe fn f();\n}", 3),
        ] {
            assert_eq!(found("image/src/a.rs", text), [expected(line)]);
        }
    }
}
