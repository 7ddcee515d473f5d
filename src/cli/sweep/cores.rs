//! How many cells are run at a time unless it is said.

/// As many cells as there are cores, or as `--threads` says.
pub(super) fn all_cores() -> usize {
    rayon::current_num_threads()
}
