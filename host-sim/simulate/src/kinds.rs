//! Enums of all kinds that implement a trait, so that a new kind is a file and an entry in a list.

/// Makes the enum `Kind` of types that implement a trait.
macro_rules! kinds {
    ($(#[$doc:meta])* $trait:ident: $($kind:ident),+) => {
        #[derive(Debug, Clone, PartialEq, serde::Deserialize)]
        $(#[$doc])*
        pub enum Kind {
            $(
                #[doc = concat!("See [`", stringify!($kind), "`].")]
                $kind($kind)
            ),+
        }

        impl std::ops::Deref for Kind {
            type Target = dyn $trait;

            fn deref(&self) -> &Self::Target {
                match self {
                    $(Self::$kind(kind) => kind),+
                }
            }
        }

        $(
            impl From<$kind> for Kind {
                fn from(kind: $kind) -> Self {
                    Self::$kind(kind)
                }
            }
        )+
    };
}

pub(crate) use kinds;
