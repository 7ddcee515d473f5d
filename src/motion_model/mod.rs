//! How a pose may move between frames.
