//! Where tests find what is not ours to ship, and how a test without it says that it was skipped.
//!
//! Integration tests include this file by way of `tests/support/mod.rs`; it uses the standard library alone.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};

/// `relative` below the test data, or `None` (said as [`skip`] does) where there is none.
///
/// The data is `$SKIAGRAPH_TEST_DATA`, else `../shared/data` beside the checkout. On CI (`CI=true`) it must be there.
pub(crate) fn path(relative: &str) -> Option<PathBuf> {
    let root = std::env::var_os("SKIAGRAPH_TEST_DATA").map_or_else(beside_the_checkout, PathBuf::from);
    let path = root.join(relative);
    if path.exists() {
        return Some(path);
    }
    skip(&format!("no {} (set SKIAGRAPH_TEST_DATA)", path.display()));
    None
}

fn beside_the_checkout() -> PathBuf {
    let own = Path::new(env!("CARGO_MANIFEST_DIR"));
    let checkout = own.ancestors().find(|folder| folder.join("Cargo.lock").is_file());
    checkout.unwrap_or(own).join("../shared/data")
}

/// Says that the test that calls this is skipped, and why. On CI (`CI=true`) that is a failure.
///
/// It is said on standard error, past the harness, which keeps what a passing test prints to itself; and as a line of
/// the file that `$SKIAGRAPH_SKIPPED` names, so that a run of all tests can count them at the end.
pub(crate) fn skip(reason: &str) {
    assert!(std::env::var("CI").as_deref() != Ok("true"), "skipped, which CI=true does not allow: {reason}");
    let thread = std::thread::current();
    let line = format!("{}::{}: {reason}\n", env!("CARGO_CRATE_NAME"), thread.name().unwrap_or("a test"));
    let said = std::io::stderr().write_all(format!("SKIPPED {line}").as_bytes());
    let noted = std::env::var_os("SKIAGRAPH_SKIPPED").map_or(Ok(()), |file| {
        OpenOptions::new().create(true).append(true).open(file).and_then(|mut file| file.write_all(line.as_bytes()))
    });
    assert!(said.and(noted).is_ok(), "cannot note that a test was skipped: {reason}");
}
