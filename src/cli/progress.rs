//! A progress bar on a terminal, nothing in a pipe.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A bar for `total` steps on standard error; hidden in a pipe, and if `quiet`.
pub(super) fn bar(what: &'static str, total: u64, quiet: bool) -> ProgressBar {
    let target = if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
    let style = ProgressStyle::with_template("{msg:12} {wide_bar} {percent:>3} % {eta:>4}")
        .expect("the template is valid");
    ProgressBar::with_draw_target(Some(total), target).with_style(style).with_message(what)
}
