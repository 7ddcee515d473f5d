//! Indices as job arrays write them: `3,7-8`.

/// Indices in ascending order, ranges joined: `3,7-8`. Slurm's `--array` takes it.
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
    #[test]
    fn neighbours_are_joined() {
        for (indices, ranges) in [(&[][..], ""), (&[3], "3"), (&[3, 7, 8], "3,7-8"), (&[0, 1, 2, 4, 6, 7], "0-2,4,6-7")]
        {
            assert_eq!(super::to_ranges(indices), ranges);
        }
    }
}
