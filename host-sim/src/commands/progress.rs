//! Progress on stderr, on a terminal only.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use taxel_data::progress::Progress;

/// Display of the stage that runs and how far it is; silent where stderr is no terminal.
#[derive(Debug, Clone)]
pub struct Terminal(ProgressBar);

impl Terminal {
    /// Display of progress on stderr.
    pub fn new() -> Self {
        let bar = ProgressBar::new(0);
        let style = ProgressStyle::with_template("{msg:<28} {bar:32} {pos}/{len} {elapsed}");
        if let Ok(style) = style {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(100));
        Self(bar)
    }
}

impl Progress for Terminal {
    fn stage(&self, name: &str, steps: usize) {
        self.0.set_length(steps as u64);
        self.0.set_position(0);
        self.0.set_message(name.to_owned());
        self.0.tick();
    }

    fn step(&self) {
        self.0.inc(1);
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
