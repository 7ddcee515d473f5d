//! Inverse dynamics and ground forces, as far as the simulation needs them.

mod derivatives;
mod inverse;
mod nonnegative;
mod support;
#[cfg(test)]
mod virtual_work;

use nalgebra::{DMatrix, DVector, Point3, Vector3};

use nonnegative::nonnegative_least_squares;

// Steps of inverse dynamics, for the other crates and the tests.
#[doc(hidden)]
pub use self::{
    derivatives::{Derivatives, derivatives},
    inverse::{Efforts, PointForce, inverse_dynamics},
    support::{SupportPoint, support_points},
};

/// Earth's standard gravity, m/s^2.
#[doc(hidden)]
pub const GRAVITY: f64 = 9.80665;
/// Derivatives are those of a parabola over this time before and after, seconds.
#[doc(hidden)]
pub const REACH_S: f64 = 1.0 / 15.0;
/// Smallest height of the centre of mass for converting moments to forces, metres.
const LEAST_LEVER: f64 = 0.1;
/// Edges of the pyramid inside a friction cone.
const EDGES: usize = 4;
/// Regularisation weight of the squared forces: it distributes the load among equally good points, so forces do not
/// jump between frames.
const EVEN: f64 = 1e-4;

/// The ground contact of a body: friction cones at points, each approximated by an inner pyramid.
#[doc(hidden)]
pub struct GroundSupport<'a> {
    /// Points that may carry the body.
    pub points: &'a [SupportPoint],
    /// Coefficient of friction.
    pub friction: f64,
    /// Weight of the body, newtons.
    pub weight: f64,
}

/// A wrench approximated by ground forces.
#[doc(hidden)]
pub struct GroundShare {
    /// One force per point.
    pub forces: Vec<PointForce>,
    /// The part of the wrench that the ground cannot supply: force, and moment about the centre.
    pub missing: [Vector3<f64>; 2],
}

impl GroundSupport<'_> {
    /// The forces that best approximate a wrench: its force and its moment about `centre`, world, N and N m.
    #[doc(hidden)]
    pub fn share(&self, centre: &Point3<f64>, [force, moment]: &[Vector3<f64>; 2]) -> GroundShare {
        let lever = centre.z.max(LEAST_LEVER);
        let wanted = stacked(&(force / self.weight), &(moment / (self.weight * lever)));
        let columns = self.columns(centre, lever);
        let strengths = strengths(&columns, &wanted);
        let rest = wanted - &columns * &strengths;
        let three = |first: usize| Vector3::new(rest[first], rest[first + 1], rest[first + 2]) * self.weight;
        GroundShare { forces: self.forces(&strengths), missing: [three(0), three(3) * lever] }
    }

    fn edge(&self, edge: usize) -> Vector3<f64> {
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * edge as f64 / EDGES as f64);
        Vector3::new(self.friction * cos, self.friction * sin, 1.0)
    }

    /// Wrenches of all edges about the centre of mass, each for a vertical force of the body's weight, in body
    /// weights.
    fn columns(&self, centre: &Point3<f64>, lever: f64) -> DMatrix<f64> {
        let mut columns = DMatrix::zeros(6, self.points.len() * EDGES);
        for (index, mut column) in columns.column_iter_mut().enumerate() {
            let force = self.edge(index % EDGES);
            let moment = (self.points[index / EDGES].point - centre).cross(&force) / lever;
            column.copy_from(&stacked(&force, &moment));
        }
        columns
    }

    fn forces(&self, strengths: &DVector<f64>) -> Vec<PointForce> {
        let of_point = |(index, support): (usize, &SupportPoint)| {
            let edges = (0..EDGES).map(|edge| self.edge(edge) * (self.weight * strengths[index * EDGES + edge]));
            PointForce { link: support.link, point: support.point, force: edges.sum() }
        };
        self.points.iter().enumerate().map(of_point).collect()
    }
}

/// Force along every edge, body weights.
fn strengths(columns: &DMatrix<f64>, wanted: &DVector<f64>) -> DVector<f64> {
    let edges = columns.ncols();
    if edges == 0 {
        return DVector::zeros(0);
    }
    let mut rows = columns.clone().resize_vertically(6 + edges, 0.0);
    (0..edges).for_each(|edge| rows[(6 + edge, edge)] = libm::sqrt(EVEN));
    nonnegative_least_squares(&rows, &wanted.clone().resize_vertically(6 + edges, 0.0))
}

fn stacked(force: &Vector3<f64>, moment: &Vector3<f64>) -> DVector<f64> {
    DVector::from_iterator(6, force.iter().chain(moment.iter()).copied())
}
