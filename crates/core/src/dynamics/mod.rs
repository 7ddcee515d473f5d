//! Dynamics of a motion: balance, support, and the forces it requires. Nothing is simulated.

mod derivatives;
mod inverse;
mod nonnegative;
mod support;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod virtual_work;

use nalgebra::{DMatrix, DVector, Point2, Point3, Vector3};

use crate::body::{Humanoid, LinkFrames, Motion, ROOT_STEP};
use crate::contact::{ContactError, GroundContacts, link_frames};
use crate::input::excerpt;
use crate::parallel;
use derivatives::reach_frames;
use nonnegative::nonnegative_least_squares;

// Steps of inverse dynamics, for the other crates and the tests.
#[doc(hidden)]
pub use self::{
    derivatives::{Derivatives, derivatives},
    inverse::{Efforts, PointForce, inverse_dynamics},
    support::{SupportPoint, support_points},
};
use support::{margin, support_polygon};

/// Earth's standard gravity, m/s^2.
#[doc(hidden)]
pub const GRAVITY: f64 = 9.80665;
/// Derivatives are those of a parabola over this time before and after, seconds.
#[doc(hidden)]
pub const REACH_S: f64 = 1.0 / 15.0;
/// Default friction for ground forces: that of a shoe on a dry floor, at the low end.
#[doc(hidden)]
pub const GROUND_FRICTION: f64 = 0.8;
/// Below this share of the body's weight on the ground there is no zero-moment point: flight.
const FLIGHT: f64 = 0.2;
/// Smallest height of the centre of mass for converting moments to forces, metres.
const LEAST_LEVER: f64 = 0.1;
/// Edges of the pyramid inside a friction cone.
const EDGES: usize = 4;
/// Regularisation weight of the squared forces: it distributes the load among equally good points, so forces do not
/// jump between frames.
const EVEN: f64 = 1e-4;

/// Why dynamics cannot be computed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DynamicsError {
    /// Contact cannot be computed, or a setting is invalid.
    #[error(transparent)]
    Contact(#[from] ContactError),
    /// A body without mass.
    #[error("no link of {:?} has mass; give them an <inertial>", excerpt(body))]
    NoMass {
        /// The body's name.
        body: String,
    },
}

/// Balance and forces of a motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Dynamics {
    /// One entry per frame.
    pub frames: Vec<DynamicsFrame>,
    /// Mass of the body, kilograms.
    pub mass: f64,
}

/// Balance and forces in one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct DynamicsFrame {
    /// Centre of mass, world, metres.
    pub centre_of_mass: Point3<f64>,
    /// The point on the ground at which the required force has no horizontal moment (`[Vukobratovic 2004]`), metres.
    /// `None` in flight, when the ground force is less than a fifth of the weight.
    pub zero_moment_point: Option<Point2<f64>>,
    /// The support polygon: convex hull of the points within 10 mm of the ground, anticlockwise, metres; empty in
    /// flight.
    pub support: Vec<Point2<f64>>,
    /// Distance of the zero-moment point to the edge of the support polygon, metres, negative outside; `None` if
    /// either is missing.
    pub margin_m: Option<f64>,
    /// Magnitude of the part of the root wrench that contact forces within their friction cones cannot supply, body
    /// weights: the norm of its force and of its moment about the centre of mass divided by the centre's height.
    pub residual: f64,
    /// Effort of every degree of freedom, N m or N, with the ground forces of least residual, evenly distributed.
    pub efforts: Vec<f64>,
    /// Number of degrees of freedom beyond their limits (by more than a millionth), and faster than their greatest
    /// speed.
    pub violations: [usize; 2],
}

/// Summary of a motion's dynamics.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct DynamicsSummary {
    /// Mean residual wrench, body weights.
    pub residual: f64,
    /// Share of the frames with a zero-moment point and support in which the point is outside the support polygon.
    pub outside: f64,
    /// Mean margin of the zero-moment point, metres; 0 if there never is one.
    pub margin_m: f64,
    /// Greatest effort of a joint, N m (N) per kilogram of the body.
    pub greatest_effort_per_kg: f64,
    /// Share of frames with a joint beyond its limits, and with a joint that is too fast.
    pub violations: [f64; 2],
}

impl Dynamics {
    /// Dynamics of `body` in `motion` with these contacts. Rates and accelerations are those of parabolas over 1/15 s
    /// before and after. Ground forces are the least-squares solution within friction cones (approximated by inner
    /// pyramids of four edges) of `friction`; if several solutions are equally good, the load is distributed evenly,
    /// which may differ from the true distribution.
    ///
    /// # Errors
    /// [`DynamicsError`] for a motion that is empty, belongs to another body or is not finite, a body without mass,
    /// and contacts of another length.
    pub fn from_motion(
        body: &Humanoid,
        motion: &Motion,
        contacts: &GroundContacts,
        friction: f64,
    ) -> Result<Self, DynamicsError> {
        if !(friction >= 0.0 && friction.is_finite()) {
            let expected = "a finite number, 0 or more";
            return Err(ContactError::Rule { key: "friction", expected, found: friction }.into());
        }
        let frames = link_frames(body, motion)?;
        let mass = body.total_mass();
        if mass <= 0.0 {
            return Err(DynamicsError::NoMass { body: body.name.clone() });
        }
        let known = contacts.feet[0].frames.len();
        if known != frames.len() {
            let frames_per_second = contacts.frames_per_second;
            return Err(ContactError::EmptyMotion { poses: known, frames_per_second }.into());
        }
        let motion = motion.clone().made_continuous(body);
        let clip = DynamicsInput { body, motion: &motion, frames: &frames, contacts, friction, mass };
        Ok(Self { mass, frames: parallel::map(frames.len(), |frame| clip.frame(frame)) })
    }

    /// Number of frames before and after a frame that contribute to its derivatives, at this rate.
    pub fn reach(frames_per_second: f64) -> usize {
        reach_frames(REACH_S, frames_per_second)
    }

    /// The summary.
    pub fn summary(&self) -> DynamicsSummary {
        let count = self.frames.len().max(1) as f64;
        let margins: Vec<f64> = self.frames.iter().filter_map(|frame| frame.margin_m).collect();
        let some = margins.len().max(1) as f64;
        let efforts = self.frames.iter().flat_map(|frame| &frame.efforts);
        let share = |kind: usize| self.frames.iter().filter(|f| f.violations[kind] > 0).count() as f64 / count;
        DynamicsSummary {
            residual: self.frames.iter().map(|frame| frame.residual).sum::<f64>() / count,
            outside: margins.iter().filter(|margin| **margin < 0.0).count() as f64 / some,
            margin_m: margins.iter().sum::<f64>() / some,
            greatest_effort_per_kg: efforts.map(|effort| effort.abs()).fold(0.0, f64::max) / self.mass,
            violations: [share(0), share(1)],
        }
    }
}

/// The input from which frames are computed.
struct DynamicsInput<'a> {
    body: &'a Humanoid,
    motion: &'a Motion,
    frames: &'a [LinkFrames],
    contacts: &'a GroundContacts,
    friction: f64,
    mass: f64,
}

impl DynamicsInput<'_> {
    fn frame(&self, frame: usize) -> DynamicsFrame {
        let (body, links) = (self.body, &self.frames[frame]);
        let centre = body.centre_of_mass(links).unwrap_or_else(Point3::origin);
        let change = derivatives(body, self.motion, frame, REACH_S);
        let efforts =
            |external: &[PointForce]| inverse_dynamics(body, links, &change.rates, &change.accelerations, external);
        let needed = efforts(&[]);
        let origin = links[0].translation.vector;
        let about = |point: &Vector3<f64>| needed.root_moment + (origin - point).cross(&needed.root_force);
        let weight = self.mass * GRAVITY;
        let zero_moment_point = (needed.root_force.z > FLIGHT * weight).then(|| {
            let moment = about(&Vector3::zeros());
            Point2::new(-moment.y / needed.root_force.z, moment.x / needed.root_force.z)
        });
        let points = support_points(body, links, self.contacts.touching(frame));
        let support = support_polygon(body, links, self.contacts.touching(frame));
        let ground = GroundSupport { points: &points, friction: self.friction, weight };
        let share = ground.share(&centre, &[needed.root_force, about(&centre.coords)]);
        let [force, moment] = share.missing;
        let pose = &self.motion.poses[frame];
        let fast = body.degrees_of_freedom.iter().zip(&change.rates[ROOT_STEP..]);
        DynamicsFrame {
            centre_of_mass: centre,
            margin_m: zero_moment_point.filter(|_| !support.is_empty()).map(|point| margin(&support, &point)),
            zero_moment_point,
            support,
            residual: libm::hypot(force.norm(), moment.norm() / centre.z.max(LEAST_LEVER)) / weight,
            efforts: efforts(&share.forces).joints,
            violations: [
                body.limit_violations(pose, 1e-6),
                fast.filter(|(dof, rate)| rate.abs() > dof.max_velocity).count(),
            ],
        }
    }
}

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
