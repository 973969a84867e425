//! Progress bars on standard error.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::captured;

/// A bar; invisible when it is not wanted, or standard error is no terminal.
pub(crate) fn bar(visible: bool, template: &str) -> ProgressBar {
    let visible = visible && !captured::is_captured();
    let bar = if visible { ProgressBar::new(1) } else { ProgressBar::hidden() };
    if visible {
        bar.set_draw_target(ProgressDrawTarget::stderr_with_hz(10));
    }
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    if !bar.is_hidden() {
        bar.enable_steady_tick(Duration::from_millis(200));
    }
    bar
}
