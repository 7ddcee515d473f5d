//! The cheapest one-to-one assignment of rows to columns.

/// The columns assigned to the rows of a square matrix of finite costs by the one-to-one assignment of least sum: the
/// Hungarian method of `[Kuhn 1955]` with potentials, O(n^3).
pub(super) fn cheapest(costs: &[Vec<f64>]) -> Vec<usize> {
    let size = costs.len();
    // rows and columns count from 1; column 0 holds the row that is being assigned
    let (mut of_row, mut of_column) = (vec![0.0; size + 1], vec![0.0; size + 1]);
    let mut row_at = vec![0; size + 1];
    for row in 1..=size {
        row_at[0] = row;
        let mut least = vec![f64::INFINITY; size + 1];
        let (mut way, mut done) = (vec![0; size + 1], vec![false; size + 1]);
        let mut column = 0;
        while row_at[column] != 0 {
            done[column] = true;
            let (current, mut next, mut step) = (row_at[column], 0, f64::INFINITY);
            for other in (1..=size).filter(|other| !done[*other]) {
                let reduced = costs[current - 1][other - 1] - of_row[current] - of_column[other];
                if reduced < least[other] {
                    (least[other], way[other]) = (reduced, column);
                }
                if least[other] < step {
                    (step, next) = (least[other], other);
                }
            }
            for other in 0..=size {
                if done[other] {
                    of_row[row_at[other]] += step;
                    of_column[other] -= step;
                } else {
                    least[other] -= step;
                }
            }
            column = next;
        }
        while column != 0 {
            row_at[column] = row_at[way[column]];
            column = way[column];
        }
    }
    let mut columns = vec![0; size];
    (1..=size).for_each(|column| columns[row_at[column] - 1] = column - 1);
    columns
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn sum(costs: &[Vec<f64>], columns: &[usize]) -> f64 {
        columns.iter().enumerate().map(|(row, column)| costs[row][*column]).sum()
    }

    /// The least sum over all permutations of the columns.
    fn by_trying(costs: &[Vec<f64>], taken: &mut Vec<usize>) -> f64 {
        let row = taken.len();
        if row == costs.len() {
            return 0.0;
        }
        let mut least = f64::INFINITY;
        for column in 0..costs.len() {
            if !taken.contains(&column) {
                taken.push(column);
                least = least.min(costs[row][column] + by_trying(costs, taken));
                taken.pop();
            }
        }
        least
    }

    proptest! {
        #[test]
        fn no_other_assignment_is_cheaper(
            costs in (1..6_usize).prop_flat_map(|size| {
                prop::collection::vec(prop::collection::vec(0.0..10.0_f64, size), size)
            })
        ) {
            let columns = cheapest(&costs);
            let mut sorted = columns.clone();
            sorted.sort_unstable();
            prop_assert_eq!(sorted, (0..costs.len()).collect::<Vec<_>>());
            prop_assert!((sum(&costs, &columns) - by_trying(&costs, &mut Vec::new())).abs() < 1e-9);
        }
    }
}
