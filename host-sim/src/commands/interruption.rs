//! Signals that end the program: it leaves no temporary file, and work with a device ends in good order.

pub use system::{end, flag, watch};

#[cfg(unix)]
mod system {
    use std::io::IsTerminal;
    use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};
    use std::sync::{Arc, OnceLock};
    use std::{fs, io, process, thread};

    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
    use signal_hook::iterator::Signals;
    use signal_hook::low_level;
    use taxel_data::output;

    /// The last signal.
    static SIGNAL: AtomicI32 = AtomicI32::new(SIGINT);

    /// Flag that the first signal sets, instead of ending the program.
    static GENTLE: OnceLock<Arc<AtomicBool>> = OnceLock::new();

    /// Lets the program end at once by Ctrl-C, SIGTERM and SIGHUP, without temporary files. A file that grows beyond
    /// what the shell allows is an error of the write.
    pub fn watch() -> io::Result<()> {
        let watched = [SIGINT, SIGTERM, SIGHUP].into_iter().filter(|signal| !is_ignored(*signal));
        let mut signals = Signals::new(watched)?;
        signal_hook::flag::register(SIGXFSZ, Arc::default())?;
        thread::spawn(move || {
            for signal in signals.forever() {
                SIGNAL.store(signal, Ordering::SeqCst);
                let is_first = |flag: &Arc<AtomicBool>| !flag.swap(true, Ordering::SeqCst);
                if !GENTLE.get().is_some_and(is_first) {
                    output::abandon();
                    // A bar of progress stands on its line.
                    let bar = if std::io::stderr().is_terminal() { "\n" } else { "" };
                    eprintln!(
                        "{bar}interrupted: no file is half-written; each is whole or unchanged"
                    );
                    end();
                }
            }
        });
        Ok(())
    }

    /// Flag that the first signal sets from now on, instead of ending the program.
    pub fn flag() -> Arc<AtomicBool> {
        GENTLE.get_or_init(Arc::default).clone()
    }

    /// Ends the program by the last signal, so that its caller knows.
    pub fn end() -> ! {
        let signal = SIGNAL.load(Ordering::SeqCst);
        let _ = low_level::emulate_default_handler(signal);
        process::exit(128 + signal)
    }

    /// Whether the caller wants a signal to be ignored, as `nohup` does, as far as that can be told.
    fn is_ignored(signal: i32) -> bool {
        let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
        let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
        let ignored = ignored.and_then(|bits| u64::from_str_radix(bits.trim(), 16).ok());
        ignored.is_some_and(|bits| bits >> (signal - 1) & 1 == 1)
    }
}

#[cfg(not(unix))]
mod system {
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;

    use signal_hook::consts::{SIGINT, SIGTERM};
    use signal_hook::flag::{register, register_conditional_shutdown};

    /// Exit status of a program that Ctrl-C ended.
    const INTERRUPTED: i32 = 130;

    /// Here Ctrl-C ends the program as the system does it.
    pub fn watch() -> std::io::Result<()> {
        Ok(())
    }

    /// Flag that the first signal sets from now on, instead of ending the program.
    pub fn flag() -> Arc<AtomicBool> {
        let interrupted = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM] {
            // In this order: the first signal finds the flag clear, and the second finds it set.
            let _ = register_conditional_shutdown(signal, INTERRUPTED, interrupted.clone())
                .and_then(|_| register(signal, interrupted.clone()));
        }
        interrupted
    }

    /// Ends the program.
    pub fn end() -> ! {
        std::process::exit(INTERRUPTED)
    }
}
