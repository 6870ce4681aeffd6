//! Scenes that are part of the program: `scenes/` at the top of the project, to which a link leads from this crate, so that
//! its package holds them.

/// Names and texts of the built-in scenes.
pub const ALL: [(&str, &str); 6] = [
    ("paper", include_str!("../scenes/paper.toml")),
    ("press", include_str!("../scenes/press.toml")),
    ("contact", include_str!("../scenes/contact.toml")),
    ("moving", include_str!("../scenes/moving.toml")),
    ("shear", include_str!("../scenes/shear.toml")),
    ("paper-as-printed", include_str!("../scenes/paper-as-printed.toml")),
];
