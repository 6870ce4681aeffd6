#![doc = include_str!("README.md")]
#![no_std]

/// Names and texts of the scenes that are part of the program.
pub const ALL: [(&str, &str); 5] = [
    ("paper", include_str!("paper.toml")),
    ("press", include_str!("press.toml")),
    ("contact", include_str!("contact.toml")),
    ("moving", include_str!("moving.toml")),
    ("paper-as-printed", include_str!("paper-as-printed.toml")),
];
