//! Attributes the error of a run to its causes, by giving the tracker the truth in place of each of its inputs.
//!
//! [`explain`] tracks the run's set again with subsets of the inputs ([`Player`]s of a game, in the words of
//! `[Shapley 1953]`) replaced by the truth (`swap`), and divides the error among them (`shares`).

mod cell;
mod cut;
mod errors;
mod explaining;
mod explanation;
mod landscape;
mod page;
mod player;
mod shares;
mod source;
mod swap;
mod worst;

pub use explaining::{ExplainOptions, explain};
pub use explanation::{Cause, CauseParts, ExplainedCell, Explanation, Landscape, NotReplaced, Repetition, WorstSecond};
pub(crate) use page::{again, notes};
pub use player::Player;

pub(crate) const EXPLAIN_FILE: &str = "explain.json";
pub(crate) const EXPLAIN_PAGE: &str = "explain.html";
