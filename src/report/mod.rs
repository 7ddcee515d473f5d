//! Pictures, plots and one self-contained HTML page.
