//! Compiling a kernel for several instruction sets and choosing among them when it runs.

/// A kernel and what it works on.
pub(crate) trait Dispatched {
    type Output;

    /// Does the work. It, and all that it calls, must be `#[inline(always)]` to be compiled for the chosen instructions.
    fn work(self) -> Self::Output;
}

/// Does the work with the best instructions this processor has.
///
/// A closure would not do: where one can be called more than once, `FnOnce::call_once` is a function of its own that the
/// compiler makes for the baseline, and everything is inlined there instead of into the function with better instructions.
pub(crate) fn dispatch<D: Dispatched>(work: D) -> D::Output {
    pulp::Arch::new().dispatch(Kernel(work))
}

struct Kernel<D>(D);

impl<D: Dispatched> pulp::WithSimd for Kernel<D> {
    type Output = D::Output;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> D::Output {
        self.0.work()
    }
}
