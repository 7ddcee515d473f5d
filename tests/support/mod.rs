//! What several integration tests share.
#![allow(dead_code, reason = "each test binary uses its own part")]

use std::path::PathBuf;

/// `relative` below the test data, or `None` (said on stderr) where there is none; on CI (`CI=true`) it must be there.
pub(crate) fn test_data(relative: &str) -> Option<PathBuf> {
    let root = std::env::var_os("SKIAGRAPH_TEST_DATA")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), PathBuf::from);
    let path = root.join(relative);
    if path.exists() {
        return Some(path);
    }
    assert!(std::env::var("CI").as_deref() != Ok("true"), "test data missing on CI: {}", path.display());
    eprintln!("SKIPPED: no {} (set SKIAGRAPH_TEST_DATA)", path.display());
    None
}
