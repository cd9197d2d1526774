//! How much memory there is to be had.
//!
//! Work whose need is known before it starts asks here, and refuses what can't be had with the
//! numbers, where the system would end the program in its midst. What is available is a guess at
//! one moment: other programs take and give. Where the system does not tell, nothing is refused.

use std::fmt;
use std::sync::OnceLock;

/// More memory would be needed than there is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "this needs about {} of memory, and {} are available",
    Bytes(*.needed),
    Bytes(*.available)
)]
pub struct Shortage {
    /// Bytes needed, about.
    pub needed: u64,
    /// Bytes available.
    pub available: u64,
}

/// Needs below this are not looked into where the process has no limit: asking the system would take
/// longer than the work.
const SMALL: u64 = 1 << 26;

/// What is kept of a limit of the process for all that is not asked for.
const RESERVE: u64 = 1 << 24;

/// Refuses to take `needed` bytes where the system has not that many to spare.
///
/// # Errors
/// [`Shortage`].
pub fn ask(needed: u64) -> Result<(), Shortage> {
    compare(needed, available_for(needed))
}

/// Bytes that may be taken, where it is worth asking before `needed` bytes are.
#[must_use]
pub fn available_for(needed: u64) -> Option<u64> {
    if needed > SMALL || is_limited() { available() } else { None }
}

/// Whether the memory of this process is limited by itself, as by `ulimit -v`.
#[must_use]
pub fn is_limited() -> bool {
    // Limits are set before a process starts.
    static LIMITED: OnceLock<bool> = OnceLock::new();
    *LIMITED.get_or_init(|| below_limits().is_some())
}

fn compare(needed: u64, available: Option<u64>) -> Result<(), Shortage> {
    match available {
        Some(available) if needed > available => Err(Shortage { needed, available }),
        Some(_) | None => Ok(()),
    }
}

/// Bytes that this process may still take, as the system tells: the least of free memory and of
/// what limits of the process (`ulimit -v`, `ulimit -d`) and of its control group leave.
#[must_use]
pub fn available() -> Option<u64> {
    [free(), below_limits(), in_group()].into_iter().flatten().min()
}

/// Free memory of the machine, caches included.
fn free() -> Option<u64> {
    kibibytes(&std::fs::read_to_string("/proc/meminfo").ok()?, "MemAvailable:")
}

/// What the limits of this process leave.
fn below_limits() -> Option<u64> {
    let limits = std::fs::read_to_string("/proc/self/limits").ok()?;
    let rows = [("Max address space", "VmSize:"), ("Max data size", "VmData:")];
    let rows = rows.map(|(row, used)| Some((soft_limit(&limits, row)?, used)));
    // The size of the process is asked for only where it matters.
    rows.iter().any(Option::is_some).then_some(())?;
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let left = |(limit, used): (u64, &str)| {
        Some(limit.saturating_sub(kibibytes(&status, used)?).saturating_sub(RESERVE))
    };
    rows.into_iter().flatten().filter_map(left).min()
}

/// What the limit of this process' control group leaves; files that are cached there don't count.
fn in_group() -> Option<u64> {
    let groups = std::fs::read_to_string("/proc/self/cgroup").ok()?;
    let own = groups.lines().find_map(|line| line.strip_prefix("0::"))?;
    let read = |file: &str| {
        std::fs::read_to_string(format!("/sys/fs/cgroup{}/{file}", own.trim_end_matches('/'))).ok()
    };
    let number = |text: String| text.trim().parse::<u64>().ok();
    let limit = number(read("memory.max")?)?;
    let used = number(read("memory.current")?)?;
    let statistics = read("memory.stat")?;
    let cached = statistics.lines().find_map(|line| line.strip_prefix("file "))?;
    Some(limit.saturating_sub(used.saturating_sub(cached.parse().ok()?)))
}

/// The number of the line that begins with `name`, in bytes.
fn kibibytes(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes.saturating_mul(1024))
}

/// The soft limit in the row that begins with `name`; none if there is no limit.
fn soft_limit(limits: &str, name: &str) -> Option<u64> {
    let line = limits.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next()?.parse().ok()
}

/// A number of bytes as people say it.
#[derive(Clone, Copy, Debug)]
pub struct Bytes(pub u64);

impl fmt::Display for Bytes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(bytes) = *self;
        if bytes >= 1 << 30 {
            write!(f, "{:.1} GiB", bytes as f64 / (1_u64 << 30) as f64)
        } else {
            write!(f, "{:.1} MiB", bytes as f64 / (1_u64 << 20) as f64)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shortage_says_both_numbers() {
        assert_eq!(compare(1 << 40, None), Ok(()));
        assert_eq!(compare(1 << 40, Some(1 << 40)), Ok(()));
        let shortage = compare(5 << 29, Some(3 << 19)).unwrap_err();
        assert_eq!(
            shortage.to_string(),
            "this needs about 2.5 GiB of memory, and 1.5 MiB are available"
        );
    }

    #[test]
    fn no_machine_has_an_exbibyte() {
        if available().is_some() {
            assert!(ask(1 << 60).is_err());
        }
        assert_eq!(ask(1 << 20), Ok(()));
    }

    #[test]
    fn rows_of_the_system_are_read() {
        let limits = "Limit                     Soft Limit           Hard Limit           Units\n\
            Max data size             unlimited            unlimited            bytes\n\
            Max address space         1048576000           unlimited            bytes\n";
        assert_eq!(soft_limit(limits, "Max address space"), Some(1_048_576_000));
        assert_eq!(soft_limit(limits, "Max data size"), None);
        assert_eq!(kibibytes("a: 1 kB\nVmSize:\t    20 kB\n", "VmSize:"), Some(20_480));
        assert_eq!(kibibytes("VmSize:\t many", "VmSize:"), None);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn this_system_tells() {
        let available = available().expect("Linux tells");
        assert!(available > 1 << 20, "{available}");
    }
}
