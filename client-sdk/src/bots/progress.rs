//! Progress for a person who watches: bars on a terminal, nothing elsewhere.

use std::{borrow::Cow, time::Duration};

use indicatif::{ProgressBar, ProgressStyle};

/// A bar that counts bots.
pub fn counting(bots: usize) -> ProgressBar {
    bar(bots as u64, "{msg:10} [{bar:40}] {pos}/{len}")
}

/// A bar that counts milliseconds up to `duration`.
pub fn timing(duration: Duration) -> ProgressBar {
    let bar = bar(u64::try_from(duration.as_millis()).unwrap_or(u64::MAX), "{prefix:10} [{bar:40}] {msg}");
    bar.set_prefix(Cow::Borrowed("driving"));
    bar
}

fn bar(length: u64, template: &'static str) -> ProgressBar {
    // Draws to standard error, and only where that is a terminal. A template that did not parse would be a plain bar.
    let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(length).with_style(style)
}
