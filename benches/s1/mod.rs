//! What the study of learned motion models is made of: who is tracked how, what was measured, and the page that tells
//! it.

pub(crate) mod best_latent;
pub(crate) mod learning;
pub(crate) mod page;
pub(crate) mod parts;
pub(crate) mod units;
