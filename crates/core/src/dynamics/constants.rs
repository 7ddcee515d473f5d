//! Constants of dynamics and simulation.

/// Earth's standard gravity, m/s^2.
pub const GRAVITY: f64 = 9.80665;
/// Derivatives are those of a parabola over this time before and after, seconds.
pub const REACH_S: f64 = 1.0 / 15.0;
