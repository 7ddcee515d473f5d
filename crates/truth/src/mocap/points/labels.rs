//! Labels that occur more than once: several subjects with the same markers, and several points with the same label.

use std::collections::{BTreeMap, BTreeSet};

use super::PointFile;
use super::names::{are_french, is_given_twice, short_list, standard_name};
use crate::mocap::ReadOptions;
use skiagraph_core::input::excerpt;

/// Of two points with the same label, the one seen less than this share as often as the other is a ghost.
const GHOST_SHARE: f64 = 0.8;

/// Keeps the labels of the subject that is chosen, and gives every point a label of its own.
///
/// # Errors
/// A message if the file has several subjects, or several points for one marker, and none is chosen.
pub(super) fn make_unique(points: &mut PointFile, options: &ReadOptions) -> Result<(), String> {
    match &options.subject {
        Some(subject) => keep_subject(points, subject)?,
        None => expect_one_subject(points, options)?,
    }
    let mut columns: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    for (column, label) in points.names.iter().enumerate().filter(|(_, label)| !label.is_empty()) {
        columns.entry(label.clone()).or_default().push(column);
    }
    for (label, columns) in columns.into_iter().filter(|(_, columns)| columns.len() > 1) {
        resolve(points, &label, columns, options)?;
    }
    Ok(())
}

/// The subject of a label: `Anna` of `Anna:LKNE`, empty if there is none.
fn subject_of(label: &str) -> &str {
    label.rsplit_once(':').map_or("", |(subject, _)| subject.trim())
}

fn keep_subject(points: &mut PointFile, subject: &str) -> Result<(), String> {
    let all: BTreeSet<&str> = points.names.iter().map(|label| subject_of(label)).collect();
    if !all.contains(subject) {
        let all: Vec<String> = all.into_iter().map(|subject| format!("{subject:?}")).collect();
        return Err(format!("subject: the file has no labels of {subject:?}; it has those of {}", short_list(&all)));
    }
    points.names.iter_mut().filter(|label| subject_of(label) != subject).for_each(String::clear);
    Ok(())
}

/// Refuses two subjects with the same marker, unless a map says which one is used.
fn expect_one_subject(points: &PointFile, options: &ReadOptions) -> Result<(), String> {
    let mut subjects: BTreeMap<String, BTreeSet<&str>> = BTreeMap::new();
    let is_french = are_french(&points.names);
    for label in &points.names {
        if let Some(name) = standard_name(label, is_french).filter(|name| !options.markers.contains_key(name)) {
            subjects.entry(name).or_default().insert(subject_of(label));
        }
    }
    let Some(several) = subjects.into_values().max_by_key(BTreeSet::len).filter(|several| several.len() > 1) else {
        return Ok(());
    };
    let several: Vec<String> = several.into_iter().map(|subject| format!("{subject:?}")).collect();
    let first = several.iter().find(|subject| *subject != "\"\"").cloned().unwrap_or_default();
    Err(format!(
        "the same markers of {} subjects, {}: set `subject` of `[motion]` to one of them, for example subject = {first}",
        several.len(),
        short_list(&several)
    ))
}

/// Joins the parts of a point that was lost and found again, drops ghosts, and numbers the points that remain.
fn resolve(points: &mut PointFile, label: &str, mut columns: Vec<usize>, options: &ReadOptions) -> Result<(), String> {
    let seen = |column: usize| points.frames.iter().filter(|frame| frame[column].is_some()).count();
    let counts: BTreeMap<usize, usize> = columns.iter().map(|column| (*column, seen(*column))).collect();
    let at_once = |frame: &Vec<Option<[f64; 3]>>| columns.iter().filter(|column| frame[**column].is_some()).count() > 1;
    let count = columns.len();
    if !points.frames.iter().any(at_once) {
        for frame in &mut points.frames {
            frame[columns[0]] = columns.iter().find_map(|column| frame[*column]);
        }
        columns[1..].iter().for_each(|column| points.names[*column].clear());
        points.notes.push(format!("{count} points have the label {}, never at once: joined", excerpt(label)));
        return Ok(());
    }
    // most often seen first, else in the order of the file
    columns.sort_by_key(|column| std::cmp::Reverse(counts[column]));
    let most = counts[&columns[0]];
    let is_ghost = |column: &usize| (counts[column] as f64) < GHOST_SHARE * most as f64;
    columns.iter().filter(|column| is_ghost(column)).for_each(|column| points.names[*column].clear());
    columns.retain(|column| !is_ghost(column));
    if columns.len() == 1 {
        points.notes.push(format!(
            "{count} points have the label {}: the one seen most, in {most} of {} frames, is used",
            excerpt(label),
            points.frames.len()
        ));
        return Ok(());
    }
    if columns.len() == 2 && is_given_twice(label) {
        return Ok(());
    }
    let is_mapped = |wanted: &String| wanted.split('+').any(|own| is_label_or_its_copy(own.trim(), label));
    if let Some(name) =
        standard_name(label, are_french(&points.names)).filter(|_| !options.markers.values().any(is_mapped))
    {
        let label = excerpt(label);
        return Err(format!(
            "{count} points have the label {label}: set `marker_map` of `[motion]`, for example {name} = \"{label}\" for \
             the first, \"{label}#2\" for the second, \"{label}+{label}#2\" for their midpoint"
        ));
    }
    for (number, column) in (1..).zip(columns).skip(1) {
        points.names[column] = format!("{label}#{number}");
    }
    Ok(())
}

/// Whether a label of `marker_map` is `label`, or `label#2` and so on.
fn is_label_or_its_copy(wanted: &str, label: &str) -> bool {
    wanted.strip_prefix(label).is_some_and(|rest| rest.is_empty() || rest.starts_with('#'))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points with these labels, seen in the first of ten frames up to a number.
    fn points(columns: &[(&str, std::ops::Range<usize>)]) -> PointFile {
        let at = |frame: usize| columns.iter().map(move |(_, seen)| seen.contains(&frame).then_some([frame as f64; 3]));
        PointFile {
            names: columns.iter().map(|(label, _)| (*label).to_owned()).collect(),
            frames: (0..10).map(|frame| at(frame).collect()).collect(),
            ..PointFile::default()
        }
    }

    fn unique(mut points: PointFile, options: &ReadOptions) -> Result<PointFile, String> {
        make_unique(&mut points, options)?;
        Ok(points)
    }

    // The markers of two people were mixed: those that one lacks were taken from the other.
    #[test]
    fn two_subjects_need_a_choice() {
        let both = points(&[("Anna:LKNE", 0..10), ("Ben:LKNE", 0..10), ("Ben:RKNE", 0..10)]);
        let message = unique(both.clone(), &ReadOptions::default()).unwrap_err();
        assert!(message.contains("2 subjects, \"Anna\", \"Ben\""), "{message}");
        assert!(message.contains("subject = \"Anna\""), "{message}");
        let of = |subject: &str| ReadOptions { subject: Some(subject.to_owned()), ..ReadOptions::default() };
        assert_eq!(unique(both.clone(), &of("Ben")).unwrap().names, ["", "Ben:LKNE", "Ben:RKNE"]);
        assert!(unique(both, &of("Eve")).unwrap_err().contains("it has those of \"Anna\", \"Ben\""));
        let one = points(&[("Anna:LKNE", 0..10), ("Rod:top", 0..10), ("RKNE", 0..10)]);
        assert_eq!(unique(one.clone(), &ReadOptions::default()).unwrap(), one);
    }

    // The first of two points with one label was used, though it was a reflection.
    #[test]
    fn a_label_that_occurs_twice_is_resolved() {
        let plain = ReadOptions::default();
        let ghost = unique(points(&[("LKNE", 0..5), ("LKNE", 0..10)]), &plain).unwrap();
        assert_eq!(ghost.names, ["", "LKNE"]);
        assert_eq!(ghost.notes, ["2 points have the label LKNE: the one seen most, in 10 of 10 frames, is used"]);
        let parts = unique(points(&[("LKNE", 0..5), ("LKNE", 5..10)]), &plain).unwrap();
        assert_eq!((parts.names[1].as_str(), parts.frames[9][0]), ("", Some([9.0; 3])));
        let both = points(&[("LELB", 0..10), ("LELB", 0..9), ("odd", 0..9), ("odd", 0..9)]);
        let message = unique(both.clone(), &plain).unwrap_err();
        assert!(message.contains("2 points have the label LELB") && message.contains("LELB#2"), "{message}");
        let markers = BTreeMap::from([("left_elbow".to_owned(), "LELB+LELB#2".to_owned())]);
        let named = unique(both, &ReadOptions { markers, ..ReadOptions::default() }).unwrap();
        assert_eq!(named.names, ["LELB", "LELB#2", "odd", "odd#2"]);
    }
}
