//! Divides a sweep into parts of about equal work, and formats indices for job arrays.

use std::ops::Range;

use super::plan_file::SweepCell;

/// Part `part` (from 1) of `parts`: a range of consecutive cells with about an equal share of the work. The ranges of
/// all parts are disjoint and cover the plan.
pub fn part_of(cells: &[SweepCell], part: usize, parts: usize) -> Range<usize> {
    if part == 0 || part > parts {
        return 0..0;
    }
    let last = if part == parts { cells.len() } else { end_of(cells, part, parts) };
    end_of(cells, part - 1, parts)..last
}

/// The number of cells in the first `part` of `parts`.
fn end_of(cells: &[SweepCell], part: usize, parts: usize) -> usize {
    let total: u128 = cells.iter().map(|cell| u128::from(cell.weight.max(1))).sum();
    let wanted = total * part as u128;
    let mut sum = 0_u128;
    for (count, cell) in cells.iter().enumerate() {
        // a cell belongs to the part that contains its midpoint
        let middle = 2 * sum + u128::from(cell.weight.max(1));
        if middle * parts as u128 > 2 * wanted {
            return count;
        }
        sum += u128::from(cell.weight.max(1));
    }
    cells.len()
}

/// Ascending indices in the format of Slurm's `--array`: `3,7-8`.
pub fn to_ranges(indices: &[usize]) -> String {
    let mut ranges: Vec<[usize; 2]> = Vec::new();
    for index in indices {
        match ranges.last_mut() {
            Some([_, last]) if *last + 1 == *index => *last = *index,
            _ => ranges.push([*index, *index]),
        }
    }
    let words = |[first, last]: &[usize; 2]| if first == last { first.to_string() } else { format!("{first}-{last}") };
    ranges.iter().map(words).collect::<Vec<_>>().join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells(weights: &[u64]) -> Vec<SweepCell> {
        let cell = |(index, weight): (usize, &u64)| SweepCell {
            index,
            cell: String::new(),
            setting: index,
            seed: 0,
            set: String::new(),
            weight: *weight,
            axes: serde_json::Map::new(),
            overrides: Vec::new(),
            method: None,
            report: None,
        };
        weights.iter().enumerate().map(cell).collect()
    }

    #[test]
    fn parts_cover_all_cells_once_and_weigh_about_the_same() {
        let weights: Vec<u64> = (0..97).map(|n| 10 + 37 * n % 101).collect();
        let all = cells(&weights);
        for parts in [1, 2, 7, 30, 97, 200] {
            let ranges: Vec<Range<usize>> = (1..=parts).map(|part| part_of(&all, part, parts)).collect();
            assert_eq!((ranges[0].start, ranges[parts - 1].end), (0, 97));
            assert!(ranges.windows(2).all(|pair| pair[0].end == pair[1].start), "{parts}: {ranges:?}");
            let total: u64 = weights.iter().sum();
            let share = total as f64 / parts as f64;
            for range in &ranges {
                let weight: u64 = weights[range.clone()].iter().sum();
                assert!((weight as f64 - share).abs() <= 111.0, "{parts}: {range:?} weighs {weight} of {share}");
            }
        }
        assert_eq!(part_of(&all, 0, 3), 0..0);
        assert_eq!(part_of(&all, 4, 3), 0..0);
    }
    #[test]
    fn consecutive_indices_become_ranges() {
        for (indices, ranges) in [(&[][..], ""), (&[3], "3"), (&[3, 7, 8], "3,7-8"), (&[0, 1, 2, 4, 6, 7], "0-2,4,6-7")]
        {
            assert_eq!(to_ranges(indices), ranges);
        }
    }
}
