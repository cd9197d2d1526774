//! The progress bar of work that takes more than a second, on a terminal only.

use crate::num::Progress;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{IsTerminal, stderr};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

/// Work shorter than this shows no bar.
const PATIENCE: Duration = Duration::from_secs(1);
/// Time between two looks at the counters.
const BEAT: Duration = Duration::from_millis(100);

/// Runs `work`, showing `progress` on standard error if it is a terminal, the work is long, and
/// `wanted`.
pub(super) fn with_bar<T>(progress: &Progress, wanted: bool, work: impl FnOnce() -> T) -> T {
    if !wanted || !stderr().is_terminal() {
        return work();
    }
    let (finished, signal) = channel::<()>();
    thread::scope(|scope| {
        scope.spawn(move || {
            if signal.recv_timeout(PATIENCE) != Err(RecvTimeoutError::Timeout) {
                return;
            }
            let bar = ProgressBar::with_draw_target(Some(0), ProgressDrawTarget::stderr());
            if let Ok(style) = ProgressStyle::with_template("{wide_bar} {percent:>3} % {eta:>4}") {
                bar.set_style(style);
            }
            loop {
                let (done, total) = progress.steps();
                bar.set_length(total);
                bar.set_position(done.min(total));
                if signal.recv_timeout(BEAT) != Err(RecvTimeoutError::Timeout) {
                    break;
                }
            }
            bar.finish_and_clear();
        });
        let result = work();
        drop(finished);
        result
    })
}
