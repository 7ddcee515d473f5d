//! Tests of `figures.rs`.

use super::*;
use crate::report::fixture::{Story, with_input};

fn ids(story: &Story) -> Vec<&'static str> {
    with_input(story, |input| figures(input, &input.runs[0]).unwrap().iter().map(|figure| figure.id).collect())
}

#[test]
fn a_full_run_has_every_figure() {
    let all = [
        "error",
        "markers-over-time",
        "cameras-over-time",
        "stances",
        "joints",
        "pck",
        "energy",
        "survival",
        "annealing",
    ];
    assert_eq!(ids(&Story { seeds: 2, ..Story::default() }), all);
}

fn of_joints(story: &Story) -> String {
    with_input(story, |input| per_joint(input).unwrap().unwrap().how_to_read)
}

#[test]
fn hands_and_feet_are_called_worst_only_if_they_are() {
    assert!(of_joints(&Story::default()).contains("Hands and feet are worst here"));
    let alike = of_joints(&Story { beside_m: 0.3, wander: 0.0, ..Story::default() });
    assert!(!alike.contains("Hands and feet") && alike.contains("Worst here: "), "{alike}");
}

#[test]
fn a_limb_that_is_lost_on_one_side_is_named() {
    let lost = of_joints(&Story { wrist_lost_from: Some(40), ..Story::default() });
    assert!(lost.contains("The left wrist is ") && lost.contains("one limb is lost, the other is not"), "{lost}");
    assert!(!lost.contains("swapped"));
    assert!(!of_joints(&Story::default()).contains("one limb is lost"));
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
