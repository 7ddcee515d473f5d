//! Loops that are compiled for several instruction sets, the best of which is chosen when they run.
//!
//! Sums run in lanes of a fixed number and nothing is fused, so that all builds give the same bits.

mod lanes;

pub use lanes::{add_scaled, dot, scaled_exponentials, sum};

/// A kernel and what it works on.
pub trait Dispatched {
    type Output;

    /// Does the work. It, and all that it calls, must be `#[inline(always)]` to be compiled for the chosen
    /// instructions.
    fn work(self) -> Self::Output;
}

/// Does the work with the best instruction set of this processor.
///
/// A closure does not work: if it can be called more than once, `FnOnce::call_once` is a separate function compiled for
/// the baseline, and everything is inlined there instead of into the function with the better instruction set.
pub fn dispatch<D: Dispatched>(work: D) -> D::Output {
    pulp::Arch::new().dispatch(Dispatcher(work))
}

struct Dispatcher<D>(D);

impl<D: Dispatched> pulp::WithSimd for Dispatcher<D> {
    type Output = D::Output;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> D::Output {
        self.0.work()
    }
}
