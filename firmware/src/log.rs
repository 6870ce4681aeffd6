//! Logging through defmt where the feature is on, and nothing where it is not.

/// Logs as `defmt::info!` does.
macro_rules! info {
    ($($argument:expr),+) => {
        $crate::log::log!(info, $($argument),+)
    };
}

/// Logs as `defmt::warn!` does.
macro_rules! warning {
    ($($argument:expr),+) => {
        $crate::log::log!(warn, $($argument),+)
    };
}

macro_rules! log {
    ($level:ident, $format:expr $(, $argument:expr)*) => {{
        #[cfg(feature = "defmt")]
        ::defmt::$level!($format $(, $argument)*);
        #[cfg(not(feature = "defmt"))]
        { $(let _ = &$argument;)* }
    }};
}

pub(crate) use {info, log, warning};
