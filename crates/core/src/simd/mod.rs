//! Loops compiled for several instruction sets; the best one is selected at run time.
//!
//! Sums use a fixed number of lanes and operations are never fused, so all builds give the same bits.

mod lanes;

pub use lanes::{add_scaled, dot, scaled_exponentials, sum};

/// A kernel with its data.
pub trait Dispatched {
    type Output;

    /// Runs the kernel. It and everything it calls must be `#[inline(always)]` to be compiled for the selected
    /// instructions.
    fn work(self) -> Self::Output;
}

/// Runs a kernel with the best instruction set of this processor.
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
