//! Names of libraries.

use std::fmt;

/// Longest name that is taken.
const LONGEST: usize = 63;

/// Words that no name may be: those of C and C++, headers that a file of the same name would hide, targets of CMake, and
/// beginnings of the source's own macros, and types that end with `_t`.
const TAKEN: &str = "\
    alignas alignof and asm auto bitand bitor bool break case catch char class compl concept const constexpr constinit \
    continue decltype default delete do double else enum explicit export extern false float for friend goto if import \
    inline int long module mutable namespace new noexcept not nullptr operator or private protected public register \
    requires restrict return short signed sizeof static struct switch template this throw true try typedef typeid \
    typename typeof union unsigned using virtual void volatile while xor \
    arduino assert complex ctype errno fenv inttypes iso646 limits locale math setjmp signal stdalign stdarg stdatomic \
    stdbool stddef stdint stdio stdlib stdnoreturn string strings tgmath threads time uchar unistd wchar wctype \
    all clean depend edit_cache help install list_install_components package package_source rebuild_cache test \
    network row \
    clock div imaxdiv int8 int16 int32 int64 intmax intptr ldiv lldiv max_align off pid ptrdiff size ssize uint8 uint16 \
    uint32 uint64 uintmax uintptr";

/// Name of a library, with which all names that it declares begin: an identifier of C, in small letters.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Name(String);

/// Why a text is no name of a library.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BadName {
    /// Not a small letter of English first, then small letters, digits and `_`; or too long.
    NoIdentifier,
    /// A word of C, C++ or CMake, the name of a header, or a word of the source.
    Taken,
}

impl fmt::Display for BadName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoIdentifier => write!(
                f,
                "a library's name has letters from a to z, digits and _, at most {LONGEST}, and starts with a letter"
            ),
            Self::Taken => f.write_str("it is a word of C, C++ or CMake, or the name of a header; add to it, such as my_NAME"),
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
        let is_of_name = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
        let starts_well = text.starts_with(|c: char| c.is_ascii_lowercase());
        if !starts_well || !text.chars().all(is_of_name) || text.len() > LONGEST {
            return Err(BadName::NoIdentifier);
        }
        if TAKEN.split_whitespace().any(|word| word == text) {
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
