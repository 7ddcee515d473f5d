//! A body in two poses among props, rendered by ray casting: written from the definitions, without the library's
//! kinematics, skins, intersections or cameras. Only a body's parts and a camera's parameters are taken from it.

use nalgebra::{Matrix2, Matrix3, Matrix4, Point3, Rotation3, Vector2, Vector3, Vector4};
use parry3d::query::{Ray, RayCast};
use parry3d::shape::TriMesh;
use skiagraph_core::body::{Humanoid, JointKind, Pose, Prop, SkinParts, Solid};
use skiagraph_core::camera::Camera;

/// The first surface that a ray meets.
pub(crate) struct Hit {
    /// The links whose surface is there: several if solids touch, as thigh and shank do in the ball of a knee. With
    /// each, the place of that link's point one frame later, world.
    pub(crate) parts: Vec<(usize, Point3<f64>)>,
    /// The solids of the links, or the triangle of the skin: two rays that share one met the same smooth surface.
    pub(crate) surfaces: Vec<(usize, usize)>,
    /// Along the camera's axis, metres.
    pub(crate) depth: f64,
    /// Towards the camera, world.
    pub(crate) normal: Vector3<f64>,
}

/// Surfaces within this distance of each other count as touching, metres.
const TOUCHING_M: f64 = 1e-6;

/// A camera in OpenCV's parameters.
pub(crate) struct PlainCamera {
    k: Matrix3<f64>,
    r: Matrix3<f64>,
    t: Vector3<f64>,
    lens: [f64; 5],
    near: f64,
    size: [f64; 2],
}

impl PlainCamera {
    pub(crate) fn new(camera: &Camera) -> Self {
        let rows = |m: [[f64; 3]; 3]| Matrix3::from_fn(|i, j| m[i][j]);
        Self {
            k: rows(camera.opencv_matrix()),
            r: rows(camera.opencv_rotation()),
            t: camera.opencv_translation().into(),
            lens: camera.distortion.coefficients(),
            near: camera.pinhole.near,
            size: [f64::from(camera.pinhole.width), f64::from(camera.pinhole.height)],
        }
    }

    fn distorted(&self, p: &Vector2<f64>) -> Vector2<f64> {
        let [k1, k2, p1, p2, k3] = self.lens;
        let (x, y, r2) = (p.x, p.y, p.norm_squared());
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let aside =
            Vector2::new(2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x), p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y);
        p * radial + aside
    }

    /// Pixel coordinates from the corner of the image; `None` in front of the near plane.
    pub(crate) fn project(&self, point: &Point3<f64>) -> Option<[f64; 2]> {
        let p = self.r * point.coords + self.t;
        let distorted = self.distorted(&Vector2::new(p.x / p.z, p.y / p.z));
        let pixel = self.k * distorted.push(1.0);
        (p.z >= self.near).then_some([pixel.x + 0.5, pixel.y + 0.5])
    }

    fn centre(&self) -> Vector3<f64> {
        -(self.r.transpose() * self.t)
    }

    /// The direction of unit depth, in the world, that is seen at a pixel: Newton's method with numerical derivatives.
    fn direction(&self, [u, v]: [f64; 2]) -> Option<Vector3<f64>> {
        let wanted =
            Vector2::new((u - 0.5 - self.k[(0, 2)]) / self.k[(0, 0)], (v - 0.5 - self.k[(1, 2)]) / self.k[(1, 1)]);
        let mut p = wanted;
        for _ in 0..30 {
            let off = self.distorted(&p) - wanted;
            let slope = |d: Vector2<f64>| (self.distorted(&(p + d)) - self.distorted(&(p - d))) / (2.0 * d.norm());
            let slopes = Matrix2::from_columns(&[slope(Vector2::new(1e-6, 0.0)), slope(Vector2::new(0.0, 1e-6))]);
            p -= slopes.try_inverse()? * off;
        }
        ((self.distorted(&p) - wanted).norm() < 1e-10).then(|| self.r.transpose() * p.push(1.0))
    }
}

/// `world_from_link` of every link, as matrices.
fn kinematics(body: &Humanoid, pose: &Pose) -> Vec<Matrix4<f64>> {
    let turn = |vector: Vector3<f64>| Rotation3::from_scaled_axis(vector).to_homogeneous();
    let shift = |vector: Vector3<f64>| Matrix4::new_translation(&vector);
    let at = |first: usize| Vector3::from_fn(|i, _| pose.joint_angles[first + i]);
    let mut frames = vec![pose.world_from_root.to_homogeneous()];
    for joint in &body.joints {
        let moved = match &joint.kind {
            JointKind::Fixed => Matrix4::identity(),
            JointKind::Revolute { axis, drive } => {
                turn(axis.into_inner() * (drive.multiplier * pose.joint_angles[drive.degree_of_freedom] + drive.offset))
            }
            JointKind::Prismatic { axis, drive } => shift(
                axis.into_inner() * (drive.multiplier * pose.joint_angles[drive.degree_of_freedom] + drive.offset),
            ),
            JointKind::Spherical { first } => turn(at(*first)),
            JointKind::Floating { first } => shift(at(*first)) * turn(at(first + 3)),
        };
        frames.push(frames[joint.parent] * joint.parent_from_joint.to_homogeneous() * moved);
    }
    frames
}

fn apply(frame: &Matrix4<f64>, p: &Vector3<f64>) -> Vector3<f64> {
    (frame * Vector4::new(p.x, p.y, p.z, 1.0)).xyz()
}

fn inverse(frame: &Matrix4<f64>) -> Matrix4<f64> {
    frame.try_inverse().unwrap()
}

/// Distance from the surface of a solid in its link's frame, negative inside; for a tapered capsule, the distance from
/// the nearest of the balls of which it consists.
fn distance(solid: &Solid, p: &Vector3<f64>) -> f64 {
    match solid {
        Solid::TaperedCapsule(capsule) => {
            let axis = capsule.b - capsule.a;
            let (length, narrowing) = (axis.norm(), capsule.radius_a - capsule.radius_b);
            let gap = |s: f64| {
                let share = if length > 0.0 { s / length } else { 0.0 };
                (p - capsule.a.coords - axis * share).norm() - capsule.radius_a + narrowing * share
            };
            let slope = if length > 0.0 { narrowing / length } else { 2.0 };
            if slope.abs() >= 1.0 {
                return gap(0.0).min(gap(length));
            }
            let along = (p - capsule.a.coords).dot(&axis) / length;
            let aside = (p - capsule.a.coords - axis * (along / length)).norm();
            gap((along - aside * slope / (1.0 - slope * slope).sqrt()).clamp(0.0, length))
        }
        Solid::Box { link_from_box, half_extents } => {
            let q = apply(&inverse(&link_from_box.to_homogeneous()), p);
            let beyond = q.abs() - Vector3::from(*half_extents);
            beyond.map(|c| c.max(0.0)).norm() + beyond.max().min(0.0)
        }
        Solid::Cylinder { link_from_cylinder, radius, half_length } => {
            let q = apply(&inverse(&link_from_cylinder.to_homogeneous()), p);
            let beyond = Vector2::new(q.xy().norm() - radius, q.z.abs() - half_length);
            beyond.map(|c| c.max(0.0)).norm() + beyond.max().min(0.0)
        }
        Solid::Mesh { .. } => panic!("no shipped robot has meshes"),
    }
}

/// The first parameter along `direction` at which a ray is inside a solid, by sphere tracing: it advances by the
/// distance to the solid until that is zero.
fn enter(solid: &Solid, start: &Vector3<f64>, direction: &Vector3<f64>, limit: f64) -> Option<f64> {
    let speed = direction.norm();
    let mut s = 0.0;
    for _ in 0..500 {
        let free = distance(solid, &(start + direction * s));
        if free < 1e-8 {
            return Some(s);
        }
        s += free / speed;
        if s > limit {
            return None;
        }
    }
    None
}

/// A skin in both poses.
struct RaySkin {
    parts: SkinParts,
    now: Vec<Vector3<f64>>,
    then: Vec<Vector3<f64>>,
    mesh: TriMesh,
}

impl RaySkin {
    fn new(parts: SkinParts, frames: &[Vec<Matrix4<f64>>; 2]) -> Self {
        let bind: Vec<Matrix4<f64>> = parts.bind.iter().map(|frame| inverse(&frame.to_homogeneous())).collect();
        let placed = |frames: &Vec<Matrix4<f64>>| -> Vec<Vector3<f64>> {
            let vertices = parts.vertices.iter().zip(&parts.influences);
            vertices
                .map(|(v, own)| {
                    let term = |(link, share): &(u32, f64)| {
                        apply(&(frames[*link as usize] * bind[*link as usize]), &v.coords) * *share
                    };
                    own.iter().map(term).sum()
                })
                .collect()
        };
        let (now, then) = (placed(&frames[0]), placed(&frames[1]));
        let single = |v: &Vector3<f64>| parry3d::math::Vec3::new(v.x as f32, v.y as f32, v.z as f32);
        let mesh = TriMesh::new(now.iter().map(single).collect(), parts.triangles.clone()).unwrap();
        Self { parts, now, then, mesh }
    }

    fn corners(&self, triangle: usize) -> [Vector3<f64>; 3] {
        self.parts.triangles[triangle].map(|corner| self.now[corner as usize])
    }

    /// The link that most corners follow most, then the one with the greatest sum of shares, then the lowest.
    fn link(&self, triangle: usize) -> usize {
        let corners = self.parts.triangles[triangle].map(|corner| &self.parts.influences[corner as usize]);
        let mut votes = vec![(0, 0.0); self.parts.bind.len()];
        for own in corners {
            let mut first = own[0];
            for (link, share) in own {
                votes[*link as usize].1 += share;
                if *share > first.1 {
                    first = (*link, *share);
                }
            }
            votes[first.0 as usize].0 += 1;
        }
        // one vote of three decides nothing; shares that are equal but for rounding are equal
        let rank = |link: usize| (votes[link].0 / 2, (votes[link].1 * 1e9).round() as u64);
        (0..votes.len()).rev().max_by_key(|link| rank(*link)).unwrap()
    }

    fn cast(&self, start: &Vector3<f64>, direction: &Vector3<f64>, limit: f64) -> Option<(usize, f64)> {
        let single = |v: &Vector3<f64>| parry3d::math::Vec3::new(v.x as f32, v.y as f32, v.z as f32);
        let ray = Ray::new(single(start), single(direction));
        let hit = self.mesh.cast_local_ray_and_get_normal(&ray, limit as f32, false)?;
        let triangle = hit.subshape as usize;
        // the parameter in double precision, from the plane of the triangle
        let [a, b, c] = self.corners(triangle);
        let normal = (b - a).cross(&(c - a));
        Some((triangle, (a - start).dot(&normal) / direction.dot(&normal)))
    }

    /// The place of the point `p` of a triangle one frame later, by its coordinates along two edges.
    fn carried(&self, triangle: usize, p: &Vector3<f64>) -> Vector3<f64> {
        let [a, b, c] = self.corners(triangle);
        let basis = Matrix3::from_columns(&[b - a, c - a, (b - a).cross(&(c - a))]);
        let along = basis.try_inverse().unwrap() * (p - a);
        let [a, b, c] = self.parts.triangles[triangle].map(|corner| self.then[corner as usize]);
        a + (b - a) * along.x + (c - a) * along.y
    }

    /// Whether the segment from `point` to `point + towards` enters the body through a triangle of a link that is not
    /// in `own`, by the signed volumes of tetrahedra.
    fn hides(&self, point: &Vector3<f64>, towards: &Vector3<f64>, own: &[usize]) -> bool {
        let end = point + towards;
        let volume = |a: &Vector3<f64>, b: &Vector3<f64>, c: &Vector3<f64>, d: &Vector3<f64>| {
            (a - d).dot(&(b - d).cross(&(c - d)))
        };
        (0..self.parts.triangles.len()).any(|triangle| {
            let [a, b, c] = self.corners(triangle);
            // from outside, where a skin's triangles are counterclockwise, to inside
            let crosses = volume(&a, &b, &c, point) < 0.0 && volume(&a, &b, &c, &end) > 0.0;
            let sides = [volume(point, &end, &a, &b), volume(point, &end, &b, &c), volume(point, &end, &c, &a)];
            let within = sides.iter().all(|v| *v <= 0.0) || sides.iter().all(|v| *v >= 0.0);
            crosses && within && !own.contains(&self.link(triangle))
        })
    }
}

/// A body in two poses among props; the first pose is rendered.
pub(crate) struct RayScene<'a> {
    body: &'a Humanoid,
    frames: [Vec<Matrix4<f64>>; 2],
    links_from_world: Vec<Matrix4<f64>>,
    props: &'a [Prop],
    skin: Option<RaySkin>,
}

impl<'a> RayScene<'a> {
    pub(crate) fn new(body: &'a Humanoid, poses: &[Pose], props: &'a [Prop]) -> Self {
        let frames = [0, 1].map(|index| kinematics(body, &poses[index]));
        let skin = body.skin.as_ref().map(|skin| RaySkin::new(skin.to_parts(), &frames));
        let links_from_world = frames[0].iter().map(inverse).collect();
        Self { body, frames, links_from_world, props, skin }
    }

    /// What is seen at a pixel, in coordinates from the corner of the image.
    pub(crate) fn cast_pixel(&self, camera: &PlainCamera, pixel: [f64; 2]) -> Option<Hit> {
        let direction = camera.direction(pixel)?;
        let start = camera.centre() + direction * camera.near;
        let hit = self.first(&start, &direction, camera.near)?;
        let by_prop = |prop: &Prop| enter(&prop.solid, &start, &direction, hit.depth - camera.near).is_some();
        (!self.props.iter().any(by_prop)).then_some(hit)
    }

    fn first(&self, start: &Vector3<f64>, direction: &Vector3<f64>, near: f64) -> Option<Hit> {
        if let Some(skin) = &self.skin {
            let (triangle, s) = skin.cast(start, direction, 20.0)?;
            let [a, b, c] = skin.corners(triangle);
            let normal = (b - a).cross(&(c - a)).normalize();
            let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
            let next = Point3::from(skin.carried(triangle, &(start + direction * s)));
            let (parts, surfaces) = (vec![(skin.link(triangle), next)], vec![(0, triangle)]);
            return Some(Hit { parts, surfaces, depth: near + s, normal });
        }
        let (mut nearest, mut met) = (20.0, Vec::new());
        for (link, from_world) in self.links_from_world.iter().enumerate() {
            let (own_start, turn) = (apply(from_world, start), from_world.fixed_view::<3, 3>(0, 0).into_owned());
            let own_direction = turn * direction;
            for (index, solid) in self.body.links[link].solids.iter().enumerate() {
                if let Some(s) = enter(solid, &own_start, &own_direction, nearest + TOUCHING_M) {
                    met.push((s, link, index));
                    nearest = s.min(nearest);
                }
            }
        }
        met.retain(|(s, ..)| *s <= nearest + TOUCHING_M);
        met.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (s, link, index) = *met.first()?;
        let in_link = apply(&self.links_from_world[link], &(start + direction * s));
        let solid = &self.body.links[link].solids[index];
        let slope = |axis: Vector3<f64>| distance(solid, &(in_link + axis)) - distance(solid, &(in_link - axis));
        let slopes = Vector3::from_fn(|i, _| slope(Vector3::ith(i, 1e-6)));
        let normal = self.frames[0][link].fixed_view::<3, 3>(0, 0) * slopes.normalize();
        let carried = |link: usize| {
            let in_link = apply(&self.links_from_world[link], &(start + direction * s));
            (link, Point3::from(apply(&self.frames[1][link], &in_link)))
        };
        let parts = met.iter().map(|(_, link, _)| carried(*link)).collect();
        let surfaces = met.iter().map(|(_, link, index)| (*link, *index)).collect();
        Some(Hit { parts, surfaces, depth: near + s, normal })
    }

    /// 0 in view, 1 hidden by the body, 2 hidden only by a prop, 3 out of view.
    pub(crate) fn sight(&self, camera: &PlainCamera, point: &Point3<f64>, own: &[usize]) -> usize {
        let inside = |[u, v]: [f64; 2]| u >= 0.0 && v >= 0.0 && u < camera.size[0] && v < camera.size[1];
        if !camera.project(point).is_some_and(inside) {
            return 3;
        }
        let towards = camera.centre() - point.coords;
        let by_body = match &self.skin {
            Some(skin) => skin.hides(&point.coords, &towards, own),
            None => self.body.links.iter().enumerate().filter(|(link, _)| !own.contains(link)).any(|(link, part)| {
                let from_world = &self.links_from_world[link];
                let at = apply(from_world, &point.coords);
                let towards = from_world.fixed_view::<3, 3>(0, 0) * towards;
                part.solids.iter().any(|s| distance(s, &at) > 0.0 && enter(s, &at, &towards, 1.0).is_some())
            }),
        };
        let by_prop = || self.props.iter().any(|prop| enter(&prop.solid, &point.coords, &towards, 1.0).is_some());
        match by_body {
            true => 1,
            false if by_prop() => 2,
            false => 0,
        }
    }
}
