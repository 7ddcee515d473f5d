//! MPJPE after the best similarity transform of every frame.

use nalgebra::{Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};

use super::metric::{Direction, Measurement, Metric, Unit};
use super::{Sequence, mpjpe};

pub(super) const ALIGNED: Metric = Metric {
    name: "pa_mpjpe_mm",
    title: "MPJPE, Procrustes-aligned",
    meaning: "Mean distance of the markers once place, direction and size are made to fit: only the pose itself counts",
    unit: Unit::Millimetre,
    direction: Direction::LowerIsBetter,
    needs: "a frame with three markers that are in both truth and estimate",
    protocol: "mean distance of the 15 virtual markers after aligning each frame's estimate to the truth by the best \
        similarity transform (rotation, translation and scale, no reflection); pooled over all markers of all \
               frames, frames with fewer than 3 common markers skipped",
    measure: aligned,
};

/// A rotation, a scale and a translation: `x -> scale * rotation * x + translation`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Similarity {
    /// Proper rotation, never a reflection.
    pub rotation: Rotation3<f64>,
    /// Scale, >= 0.
    pub scale: f64,
    /// Translation, metres.
    pub translation: Vector3<f64>,
}

impl Similarity {
    /// The similarity that maps the first points of the pairs closest to the second, in least squares (`[Umeyama
    /// 1991]`, Eqs. 40 to 42: `K = U S V^T`, `R = V diag(1, 1, det) U^T`, `s = tr(R K) / |X|^2`). `None` for fewer
    /// than three pairs or coincident points.
    pub fn fit(pairs: &[(Point3<f64>, Point3<f64>)]) -> Option<Self> {
        if pairs.len() < 3 {
            return None;
        }
        let count = pairs.len() as f64;
        let centre_from = pairs.iter().map(|(p, _)| p.coords).sum::<Vector3<f64>>() / count;
        let centre_to = pairs.iter().map(|(_, q)| q.coords).sum::<Vector3<f64>>() / count;
        let mut covariance = Matrix3::zeros();
        let mut square = 0.0;
        for (from, to) in pairs {
            let (x, y) = (from.coords - centre_from, to.coords - centre_to);
            covariance += x * y.transpose();
            square += x.norm_squared();
        }
        if square <= f64::EPSILON {
            return None;
        }
        let decomposition = covariance.svd(true, true);
        let (u, v) = (decomposition.u?, decomposition.v_t?.transpose());
        // Without this sign a mirrored pose would fit perfectly, and exchanged left and right would not be an error.
        let sign = if (v * u.transpose()).determinant() < 0.0 { -1.0 } else { 1.0 };
        let rotation = v * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * u.transpose();
        let scale = (rotation * covariance).trace() / square;
        let translation = centre_to - scale * (rotation * centre_from);
        Some(Self { rotation: Rotation3::from_matrix_unchecked(rotation), scale, translation })
    }

    /// Transforms a point.
    pub fn apply(&self, point: &Point3<f64>) -> Point3<f64> {
        Point3::from(self.scale * (self.rotation * point.coords) + self.translation)
    }
}

/// The rotation of a frame's alignment; `None` if it cannot be aligned.
pub(super) fn aligning_rotation(sequence: &Sequence<'_>, frame: usize) -> Option<UnitQuaternion<f64>> {
    let pairs: Vec<_> = sequence.pairs(frame).map(|(_, truth, estimate)| (estimate, truth)).collect();
    Some(UnitQuaternion::from_rotation_matrix(&Similarity::fit(&pairs)?.rotation))
}

fn aligned(sequence: &Sequence<'_>) -> Option<Measurement> {
    mpjpe::pooled(sequence, |frame| {
        let pairs: Vec<_> = sequence.pairs(frame).map(|(_, truth, estimate)| (estimate, truth)).collect();
        Similarity::fit(&pairs).map_or_else(Vec::new, |similarity| {
            pairs.iter().map(|(estimate, truth)| 1000.0 * (similarity.apply(estimate) - truth).norm()).collect()
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_figure::standing;
    use proptest::prelude::*;

    #[test]
    fn two_points_or_coincident_points_cannot_be_aligned() {
        let p = Point3::origin();
        assert_eq!(Similarity::fit(&[(p, p), (p, p)]), None);
        assert_eq!(Similarity::fit(&[(p, p); 5]), None);
    }

    proptest! {
        #[test]
        fn a_planted_similarity_is_found_again(
            axis in prop::array::uniform3(-2.0..2.0_f64),
            shift in prop::array::uniform3(-5.0..5.0_f64),
            scale in 0.3..3.0_f64,
        ) {
            let planted = Similarity { rotation: Rotation3::new(axis.into()), scale, translation: shift.into() };
            let pairs: Vec<_> = standing().iter().flatten().map(|p| (*p, planted.apply(p))).collect();
            let found = Similarity::fit(&pairs).unwrap();
            prop_assert!((found.scale - scale).abs() < 1e-9);
            prop_assert!((found.rotation.matrix() - planted.rotation.matrix()).norm() < 1e-9);
            prop_assert!((found.translation - planted.translation).norm() < 1e-8);
        }
    }
}
