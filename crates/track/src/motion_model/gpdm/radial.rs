//! The radial kernel `amplitude exp(-width/2 |x - y|^2)`: its values and the gradient through them.

use faer::{Mat, MatRef};

use skiagraph_core::simd::{Dispatched, add_scaled, dispatch, dot, scaled_exponentials, sum};

/// Writes the values between rows of `a` and rows of `b`: entry `(i, j)` for row `i` of `a` and row `j` of `b`.
pub(super) fn radial(amplitude: f64, inverse_width: f64, a: &Mat<f64>, b: MatRef<'_, f64>, values: &mut Mat<f64>) {
    dispatch(RadialKernel { amplitude, inverse_width, a, b, lower: false, values });
}

/// Writes the lower triangle of the values between the rows of `x`.
pub(super) fn radial_lower(amplitude: f64, inverse_width: f64, x: &Mat<f64>, values: &mut Mat<f64>) {
    dispatch(RadialKernel { amplitude, inverse_width, a: x, b: x.as_ref(), lower: true, values });
}

struct RadialKernel<'a> {
    amplitude: f64,
    inverse_width: f64,
    a: &'a Mat<f64>,
    b: MatRef<'a, f64>,
    /// Whether only rows from the diagonal on are needed.
    lower: bool,
    values: &'a mut Mat<f64>,
}

impl Dispatched for RadialKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn work(self) {
        for j in 0..self.b.nrows() {
            let first = if self.lower { j } else { 0 };
            let column = &mut self.values.col_as_slice_mut(j)[first..];
            column.fill(0.0);
            for c in 0..self.a.ncols() {
                let centre = self.b[(j, c)];
                for (value, x) in column.iter_mut().zip(&self.a.col_as_slice(c)[first..]) {
                    *value += (x - centre) * (x - centre);
                }
            }
            for value in column.iter_mut() {
                *value *= -0.5 * self.inverse_width;
            }
            scaled_exponentials(column, self.amplitude);
        }
    }
}

/// The gradients through a radial kernel, given the derivative by the kernel matrix.
pub(super) struct RadialGradient {
    /// By the inputs, `-2 width (diag(S 1) X - S X)`.
    pub(super) inputs: Mat<f64>,
    /// By `ln width`, `-width/2 sum(S o dist^2)`.
    pub(super) width: f64,
    /// By `ln amplitude`, the sum of `S`.
    pub(super) amplitude: f64,
}

/// For `S = G o R` with the derivative `G` by the kernel matrix and the radial kernel `R` between the rows of `x`, both
/// symmetric and given by their lower triangles.
pub(super) fn radial_gradient(g: &Mat<f64>, r: &Mat<f64>, inverse_width: f64, x: &Mat<f64>) -> RadialGradient {
    let (n, d) = (x.nrows(), x.ncols());
    let mut products = Products { sx: Mat::zeros(n, d), sums: vec![0.0; n] };
    dispatch(WeightedProducts { g, r, x, column: &mut vec![0.0; n], products: &mut products });
    let Products { sx: mut inputs, sums } = products;
    for c in 0..d {
        let column = inputs.col_as_slice_mut(c).iter_mut().zip(x.col_as_slice(c)).zip(&sums);
        column.for_each(|((value, x), sum)| *value = -2.0 * inverse_width * (sum * x - *value));
    }
    // sum(S o dist^2) = 2 tr(X^T (diag(S 1) X - S X))
    let width = 0.5 * (0..d).map(|c| dot(x.col_as_slice(c), inputs.col_as_slice(c))).sum::<f64>();
    RadialGradient { inputs, width, amplitude: sum(&sums) }
}

/// `S X` and `S 1`.
struct Products {
    sx: Mat<f64>,
    sums: Vec<f64>,
}

struct WeightedProducts<'a> {
    g: &'a Mat<f64>,
    r: &'a Mat<f64>,
    x: &'a Mat<f64>,
    /// Memory for a column of `S`.
    column: &'a mut [f64],
    products: &'a mut Products,
}

impl Dispatched for WeightedProducts<'_> {
    type Output = ();

    #[inline(always)]
    fn work(self) {
        let n = self.x.nrows();
        let Products { sx, sums } = self.products;
        for j in 0..n {
            let (g, r) = (&self.g.col_as_slice(j)[j..], &self.r.col_as_slice(j)[j..]);
            let s = &mut self.column[..n - j];
            for (s, (g, r)) in s.iter_mut().zip(g.iter().zip(r)) {
                *s = g * r;
            }
            let (diagonal, below) = (s[0], &s[1..]);
            sums[j] += diagonal + sum(below);
            add_scaled(&mut sums[j + 1..], 1.0, below);
            for c in 0..self.x.ncols() {
                add_symmetric_column(diagonal, below, &self.x.col_as_slice(c)[j..], &mut sx.col_as_slice_mut(c)[j..]);
            }
        }
    }
}

/// Adds the contribution of one column of a symmetric matrix, from its diagonal down, to the product with `x`.
#[inline(always)]
fn add_symmetric_column(diagonal: f64, below: &[f64], x: &[f64], product: &mut [f64]) {
    product[0] += diagonal * x[0] + dot(below, &x[1..]);
    add_scaled(&mut product[1..], x[0], below);
}

/// `S X` for the symmetric `S` with the given lower triangle.
pub(super) fn symmetric_times(s: &Mat<f64>, x: &Mat<f64>) -> Mat<f64> {
    let mut product = Mat::zeros(x.nrows(), x.ncols());
    dispatch(SymmetricProduct { s, x, product: &mut product });
    product
}

struct SymmetricProduct<'a> {
    s: &'a Mat<f64>,
    x: &'a Mat<f64>,
    product: &'a mut Mat<f64>,
}

impl Dispatched for SymmetricProduct<'_> {
    type Output = ();

    #[inline(always)]
    fn work(self) {
        for j in 0..self.x.nrows() {
            let column = &self.s.col_as_slice(j)[j..];
            for c in 0..self.x.ncols() {
                let product = &mut self.product.col_as_slice_mut(c)[j..];
                add_symmetric_column(column[0], &column[1..], &self.x.col_as_slice(c)[j..], product);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lower_triangles_and_symmetric_products_agree_with_whole_matrices() {
        let x = Mat::from_fn(21, 3, |i, c| ((i * (c + 2)) as f64 * 0.31).sin());
        let (mut lower, mut all) = (Mat::zeros(21, 21), Mat::from_fn(21, 21, |_, _| f64::NAN));
        radial_lower(0.7, 1.3, &x, &mut lower);
        radial(0.7, 1.3, &x, x.as_ref(), &mut all);
        assert!((0..21).all(|j| (j..21).all(|i| lower[(i, j)].to_bits() == all[(i, j)].to_bits())));
        let (product, expected) = (symmetric_times(&lower, &x), &all * &x);
        assert!((0..21).all(|i| (0..3).all(|c| (product[(i, c)] - expected[(i, c)]).abs() < 1e-12)));
    }
}
