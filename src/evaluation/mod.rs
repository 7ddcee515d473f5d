//! Errors of a tracker against the truth: one file per metric.
