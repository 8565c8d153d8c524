//! Marks that say which process a temporary file or folder belongs to, for folders that several machines
//! write into and whose file system may know no locks.

use std::path::Path;
use std::sync::OnceLock;

use crate::file::read_whole;

/// Longest host name in a mark, characters.
const MOST_HOST: usize = 40;
/// Longest identity of a boot, bytes.
const MOST_BYTES: u64 = 1000;
/// Sign between the parts of a mark; no part contains it.
const BETWEEN: char = '-';

/// Machine (with its boot and its space of process numbers) and process number.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Owner {
    /// Name of the machine, its boot and its space of process numbers: `node17-8c1f00d2`.
    place: String,
    /// Process number there.
    process: u32,
}

/// Mark of this process for names of temporary files: `HOST-PLACE-PROCESS`, for example
/// `node17-8c1f00d2-4242`. PLACE is a checksum of the machine's boot and of the space of process numbers:
/// containers may share a host name, and process numbers begin anew when a machine does.
///
/// ```
/// assert_eq!(untrusted_io::owner::mark().split('-').count(), 3);
/// ```
pub fn mark() -> String {
    format!("{}{BETWEEN}{}", place(), std::process::id())
}

/// Whether a name that contains a [`mark`] after `prefix` belongs to a process that may still be
/// running: one of another machine, or one that runs here. `None` if the name has no mark.
///
/// ```
/// use untrusted_io::owner::{may_run, mark};
///
/// assert_eq!(may_run(&format!(".partial-{}-Xy12", mark()), ".partial-"), Some(true));
/// assert_eq!(may_run(".partial-elsewhere-00000000-1-Xy12", ".partial-"), Some(true));
/// assert_eq!(may_run(".partial-Xy12", ".partial-"), None);
/// ```
pub fn may_run(name: &str, prefix: &str) -> Option<bool> {
    let owner = owner_of(name.strip_prefix(prefix)?)?;
    Some(owner.place != place() || is_running(owner.process))
}

/// Reads `HOST-PLACE-PROCESS`, with something else behind it or not.
fn owner_of(text: &str) -> Option<Owner> {
    let mut parts = text.splitn(4, BETWEEN);
    let (host, place) = (parts.next()?, parts.next()?);
    let process = parts.next()?.parse().ok()?;
    let is_place = place.len() == 8 && place.bytes().all(|byte| byte.is_ascii_hexdigit());
    is_place.then(|| Owner { place: format!("{host}{BETWEEN}{place}"), process })
}

fn place() -> &'static str {
    static PLACE: OnceLock<String> = OnceLock::new();
    PLACE.get_or_init(|| {
        let boot = read_whole(Path::new("/proc/sys/kernel/random/boot_id"), MOST_BYTES);
        let boot = boot.unwrap_or_default();
        let numbers = std::fs::read_link("/proc/self/ns/pid").unwrap_or_default();
        let mut hasher = crc32fast::Hasher::new();
        hasher.update(&boot);
        hasher.update(numbers.to_string_lossy().as_bytes());
        format!("{}{BETWEEN}{:08x}", host(), hasher.finalize())
    })
}

/// Name of this machine, with nothing in it that a file name or a mark cannot have.
fn host() -> String {
    let plain = |sign: char| if sign.is_ascii_alphanumeric() || sign == '.' { sign } else { '_' };
    let name: String = host_name().chars().take(MOST_HOST).map(plain).collect();
    if name.is_empty() { "host".to_owned() } else { name }
}

#[cfg(unix)]
fn host_name() -> String {
    rustix::system::uname().nodename().to_string_lossy().into_owned()
}

#[cfg(not(unix))]
fn host_name() -> String {
    std::env::var("COMPUTERNAME").unwrap_or_default()
}

/// Whether a process of this machine runs. Where that cannot be told it does not: the lock on its file says more.
#[cfg(unix)]
fn is_running(process: u32) -> bool {
    let number = i32::try_from(process).ok().and_then(rustix::process::Pid::from_raw);
    let Some(number) = number else { return false };
    // That of another user cannot be signalled, but it runs.
    rustix::process::test_kill_process(number) != Err(rustix::io::Errno::SRCH)
}

#[cfg(not(unix))]
fn is_running(_process: u32) -> bool {
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_process_that_has_ended_is_told_from_one_that_runs() {
        let mut child = std::process::Command::new("sleep").arg("60").spawn().unwrap();
        let name = format!(".partial-{}-{}-abc123", place(), child.id());
        assert_eq!(may_run(&name, ".partial-"), Some(true));
        child.kill().unwrap();
        child.wait().unwrap();
        assert_eq!(may_run(&name, ".partial-"), Some(false));
    }

    #[test]
    fn what_runs_elsewhere_may_run() {
        for name in [".partial-node2-01234567-1-a", ".partial-a.b-ffffffff-99999-b", ".flying-x"] {
            assert_ne!(may_run(name, ".partial-"), Some(false), "{name}");
        }
        let mine = place().rsplit_once('-').unwrap().0;
        let other_boot = format!(".partial-{mine}-00000000-999999-abc");
        assert_eq!(may_run(&other_boot, ".partial-"), Some(true));
    }

    #[test]
    fn other_names_have_no_owner() {
        for name in
            [".partial-abc", ".partial-a-b-c-d", ".partial-n-0123-1-a", ".partial-n-01234567-x-a"]
        {
            assert_eq!(may_run(name, ".partial-"), None, "{name}");
        }
    }
}
