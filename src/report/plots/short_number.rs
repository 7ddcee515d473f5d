//! Numbers beside axes.

/// A number in its shortest readable form.
pub(super) fn short(value: f64) -> String {
    let rounded = (value * 1000.0).round() / 1000.0;
    if rounded == 0.0 { "0".into() } else { format!("{rounded}") }
}
