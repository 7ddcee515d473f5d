//! Runs the same work for many items, on all cores.

use std::sync::OnceLock;

use rayon::prelude::*;

/// The results of `work(0)` to `work(count - 1)` in this order, computed on all cores.
///
/// Rayon's own iterators are compiled separately for every closure, which is slow; here only the result storage is
/// monomorphised.
pub fn map<T: Send + Sync>(count: usize, work: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let places: Vec<OnceLock<T>> = (0..count).map(|_| OnceLock::new()).collect();
    on_all_cores(count, &|index| drop(places[index].set(work(index))));
    places.into_iter().filter_map(OnceLock::into_inner).collect()
}

fn on_all_cores(count: usize, work: &(dyn Fn(usize) + Sync)) {
    (0..count).into_par_iter().for_each(work);
}

#[cfg(test)]
mod tests {
    #[test]
    fn results_are_in_order_with_any_number_of_threads() {
        for threads in [1, 2, 8] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let squares = pool.install(|| super::map(1000, |index| index * index));
            assert!(squares.iter().enumerate().all(|(index, square)| *square == index * index), "{threads}");
            assert_eq!(squares.len(), 1000);
        }
        assert_eq!(super::map(0, |_| 1), Vec::<i32>::new());
    }
}
