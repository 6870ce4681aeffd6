//! The number formats of networks, in one list.

/// Number format of a network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// f32 ([`float32`](super::float32)).
    F32,
    /// 16-bit fixed point ([`fixed16`](super::fixed16)).
    Fixed16,
}

/// Name, tag and description of a format.
struct Declaration {
    name: &'static str,
    tag: u8,
    description: &'static str,
}

impl Format {
    /// Every number format.
    ///
    /// ```
    /// use taxel_core::rbf::Format;
    /// let names = Format::ALL.map(Format::name);
    /// assert_eq!(names, ["f32", "fixed16"]);
    /// ```
    pub const ALL: [Self; 2] = [Self::F32, Self::Fixed16];

    const fn declaration(self) -> Declaration {
        match self {
            Self::F32 => {
                Declaration { name: "f32", tag: 1, description: "f32: exact, for any width" }
            }
            Self::Fixed16 => Declaration {
                name: "fixed16",
                tag: 2,
                description: "16-bit fixed point: less flash, and a third to a ninth of the time",
            },
        }
    }

    /// The format's name, as users choose it.
    pub const fn name(self) -> &'static str {
        self.declaration().name
    }

    /// The tag of a network's section in a blob (`docs/blob.md`).
    pub const fn tag(self) -> u8 {
        self.declaration().tag
    }

    /// Description of the format in one line.
    pub const fn description(self) -> &'static str {
        self.declaration().description
    }

    /// The format whose [name](Self::name) is `name`, if there is one.
    ///
    /// ```
    /// use taxel_core::rbf::Format;
    /// assert_eq!(Format::from_name("fixed16"), Some(Format::Fixed16));
    /// assert_eq!(Format::from_name("f64"), None);
    /// ```
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|format| format.name() == name)
    }

    /// The format whose [tag](Self::tag) is `tag`, if there is one.
    pub fn from_tag(tag: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|format| format.tag() == tag)
    }
}

#[cfg(test)]
mod tests {
    use super::Format;

    #[test]
    fn formats_have_distinct_names_tags_and_descriptions() {
        for (index, format) in Format::ALL.into_iter().enumerate() {
            assert_eq!(Format::from_name(format.name()), Some(format));
            assert_eq!(Format::from_tag(format.tag()), Some(format));
            for other in &Format::ALL[..index] {
                assert_ne!(format.name(), other.name());
                assert_ne!(format.tag(), other.tag());
                assert_ne!(format.description(), other.description());
            }
        }
    }
}
