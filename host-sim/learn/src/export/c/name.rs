//! Names of libraries.

use std::fmt;

/// Longest name; Arduino takes no longer one for a library.
const LONGEST: usize = 63;

/// Words of C and C++ that no name may be, and headers that a file of the same name would hide.
const TAKEN: &str = "\
    alignas alignof and asm auto bitand bitor bool break case catch char class compl concept const constexpr constinit \
    continue decltype default delete do double else enum explicit export extern false float for friend goto if import \
    inline int long module mutable namespace new noexcept not nullptr operator or private protected public register \
    requires restrict return short signed sizeof static struct switch template this throw true try typedef typeid \
    typename typeof union unsigned using virtual void volatile while xor \
    arduino assert complex ctype errno fenv inttypes iso646 limits locale math setjmp signal stdalign stdarg stdatomic \
    stdbool stddef stdint stdio stdlib stdnoreturn string strings tgmath threads time uchar unistd wchar wctype";

/// Name of a library, with which all names that it declares begin: an identifier of C.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Name(String);

/// Why a text is no name of a library.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BadName {
    /// Not a letter of English first, then letters, digits and `_`; or too long.
    NoIdentifier,
    /// A word of C or C++, or the name of one of their headers.
    Taken,
}

impl fmt::Display for BadName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoIdentifier => write!(
                f,
                "a name in C starts with a letter from a to z, and has letters, digits and _, {LONGEST} at most"
            ),
            Self::Taken => f.write_str("C or C++ have this word, or a header of this name"),
        }
    }
}

impl std::error::Error for BadName {}

impl Name {
    /// Checks a name.
    ///
    /// # Errors
    /// [`BadName`] says what is wrong with it.
    pub fn new(text: &str) -> Result<Self, BadName> {
        let is_of_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let starts_well = text.starts_with(|c: char| c.is_ascii_alphabetic());
        if !starts_well || !text.chars().all(is_of_name) || text.len() > LONGEST {
            return Err(BadName::NoIdentifier);
        }
        let lower = text.to_ascii_lowercase();
        if TAKEN.split_whitespace().any(|word| word == lower) {
            return Err(BadName::Taken);
        }
        Ok(Self(text.to_owned()))
    }

    /// The name as functions and files have it.
    #[must_use]
    pub fn lower(&self) -> &str {
        &self.0
    }

    /// The name as macros have it.
    #[must_use]
    pub fn upper(&self) -> String {
        self.0.to_ascii_uppercase()
    }
}
