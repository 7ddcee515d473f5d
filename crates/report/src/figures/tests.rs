//! Tests of `figures.rs`.

use super::*;
use crate::fixture::{Story, with_input};

fn ids(story: &Story) -> Vec<&'static str> {
    with_input(story, |input| figures(input, &input.runs[0]).unwrap().iter().map(|figure| figure.id).collect())
}

#[test]
fn several_models_have_their_bands_and_one_has_none() {
    assert!(ids(&Story { models: 3, ..Story::default() }).contains(&"occupancy"));
    assert!(!ids(&Story { models: 1, ..Story::default() }).contains(&"occupancy"));
}

#[test]
fn a_tracker_without_layers_and_energies_has_no_figures_of_them() {
    assert_eq!(
        ids(&Story { layers: 0, energies: false, ..Story::default() }),
        ["error", "markers-over-time", "cameras-over-time", "stances", "joints", "pck"]
    );
}
