//! scratch
pub(crate) fn tune(key: &str, default: f64) -> f64 { std::env::var(key).ok().and_then(|v| v.parse().ok()).unwrap_or(default) }
