//! Exchanged names of markers.

use super::Correction;
use super::assignment::cheapest;
use super::correction::marker_of_other_side;
use super::evidence::PairedFrames;
use crate::body::LANDMARKS;
use crate::mean;

/// Greatest share of their error that may remain after markers exchange their names.
const GAIN: f64 = 0.4;
/// Markers that more than this share of the samples have are used.
const OFTEN: f64 = 0.5;

/// The names under which the markers are nearest to the truth, with everything else read as in `correction`: the
/// cheapest assignment of the estimated markers to the true ones, of which only the cycles with a large gain are kept.
/// Cycles that only exchange left and right are ignored, because trackers do that too.
pub(super) fn names(evidence: &PairedFrames<'_>, correction: &Correction) -> [usize; LANDMARKS.len()] {
    let mut names = Correction::none().names;
    let named = Correction { names, ..correction.clone() };
    let read: Vec<_> = evidence.samples.iter().filter_map(|sample| evidence.read(*sample, &named)).collect();
    let share = |count: usize| count as f64 / read.len().max(1) as f64;
    let is_given = |marker: &usize| {
        share(read.iter().filter(|(truth, found)| truth[*marker].is_some() && found[*marker].is_some()).count()) > OFTEN
    };
    let markers: Vec<usize> = (0..LANDMARKS.len()).filter(is_given).collect();
    let cost = |marker: usize, other: usize| {
        let apart = read.iter().filter_map(|(truth, found)| Some((truth[marker]? - found[other]?).norm()));
        // never in a sample together: a prohibitive cost
        mean(&apart.collect::<Vec<f64>>()).unwrap_or(1e6)
    };
    let costs: Vec<Vec<f64>> =
        markers.iter().map(|marker| markers.iter().map(|other| cost(*marker, *other)).collect()).collect();
    let assigned = cheapest(&costs);
    for cycle in cycles(&assigned) {
        let sum = |column: &dyn Fn(usize) -> usize| cycle.iter().map(|row| costs[*row][column(*row)]).sum::<f64>();
        let gains = sum(&|row| assigned[row]) <= GAIN * sum(&|row| row);
        let is_of_sides = cycle.iter().all(|row| markers[assigned[*row]] == marker_of_other_side(markers[*row]));
        if gains && !is_of_sides {
            cycle.iter().for_each(|row| names[markers[*row]] = markers[assigned[*row]]);
        }
    }
    names
}

/// The cycles of a permutation that are longer than one.
fn cycles(permutation: &[usize]) -> Vec<Vec<usize>> {
    let mut done = vec![false; permutation.len()];
    let mut found = Vec::new();
    for start in 0..permutation.len() {
        let mut cycle = Vec::new();
        let mut at = start;
        while !std::mem::replace(&mut done[at], true) {
            cycle.push(at);
            at = permutation[at];
        }
        if cycle.len() > 1 {
            found.push(cycle);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_permutation_is_split_into_its_cycles() {
        assert_eq!(cycles(&[1, 0, 2, 4, 5, 3]), [vec![0, 1], vec![3, 4, 5]]);
        assert_eq!(cycles(&[0, 1]), Vec::<Vec<usize>>::new());
    }
}
