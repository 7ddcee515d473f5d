//! Silhouettes of tapered capsules in closed form, several at a time.
//!
//! Perspective projection maps convex hulls to convex hulls, so the silhouette of a tapered capsule beyond the near
//! plane is the hull of the outlines of its two balls. Each outline is an ellipse; if neither contains the other, the
//! hull adds the two outer tangents: the images of the planes through the camera's centre that touch both balls.
//!
//! *Ball* with centre c and radius r: the ray (u, v, 1) meets it iff (c.(u, v, 1))^2 >= (|c|^2 - r^2)(u^2 + v^2 + 1).
//! With L = cz^2 - r^2, K1 = cy^2 + L and K = cx^2 + K1 (all > 0 in front of the camera) the solutions in a row v are
//! u = cx (cy v + cz) / K1 +- sqrt(K L) / K1 sqrt(R^2 - (v - vc)^2), vc = cy cz / L, R = r sqrt(K1) / L.
//!
//! *Tangent planes* with unit normal n: n.a = ra and n.b = rb. With w = a x b and q = ra b - rb a they are n = (q x w
//! +- w sqrt(|w|^2 - |q|^2)) / |w|^2; they touch the balls at a - ra n and b - rb n.

use crate::camera::Pinhole;

use super::TaperedCapsule;
use super::strips::{ROWS, Rows};

/// Capsules processed together: enough for a body, few enough for the first-level cache.
pub(super) const BLOCK: usize = 16;

/// One number per capsule of a block.
type Lane<T> = [T; BLOCK];

/// Up to [`BLOCK`] capsules as a structure of arrays, camera frame, metres.
#[derive(Default)]
pub(super) struct CapsuleBlock {
    count: usize,
    a: [Lane<f64>; 3],
    b: [Lane<f64>; 3],
    radius_a: Lane<f64>,
    radius_b: Lane<f64>,
}

impl CapsuleBlock {
    pub(super) fn clear(&mut self) {
        self.count = 0;
    }

    pub(super) fn is_full(&self) -> bool {
        self.count == BLOCK
    }

    /// Adds a capsule; ignored if the block is full.
    #[inline(always)]
    pub(super) fn push(&mut self, capsule: &TaperedCapsule) {
        let lane = self.count;
        if lane < BLOCK {
            for axis in 0..3 {
                self.a[axis][lane] = capsule.a[axis];
                self.b[axis][lane] = capsule.b[axis];
            }
            self.radius_a[lane] = capsule.radius_a;
            self.radius_b[lane] = capsule.radius_b;
            self.count = lane + 1;
        }
    }

    /// The capsule in lane `lane < BLOCK`.
    pub(super) fn get(&self, lane: usize) -> TaperedCapsule {
        TaperedCapsule {
            a: self.a.map(|axis| axis[lane]).into(),
            b: self.b.map(|axis| axis[lane]).into(),
            radius_a: self.radius_a[lane],
            radius_b: self.radius_b[lane],
        }
    }
}

/// One ball's outline in pixels: at row centre y, with d = y - centre_y, it spans
/// `centre_x + shear d -+ half_width sqrt((radius - d)(radius + d))`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arc {
    pub(super) centre_x: f32,
    pub(super) centre_y: f32,
    pub(super) radius: f32,
    pub(super) shear: f32,
    pub(super) half_width: f32,
}

/// One outer tangent between its points of contact, pixels. NaN if there is none.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tangent {
    pub(super) x_a: f32,
    pub(super) y_a: f32,
    pub(super) x_b: f32,
    pub(super) y_b: f32,
    /// dx/dy.
    pub(super) slope: f32,
}

/// A capsule's silhouette in pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outline {
    pub(super) arcs: [Arc; 2],
    pub(super) tangents: [Tangent; 2],
    pub(super) top: f32,
    pub(super) bottom: f32,
    /// A lower bound of the leftmost point.
    pub(super) left: f32,
    /// An upper bound of the rightmost point.
    pub(super) right: f32,
}

/// Outlines as a structure of arrays, so that one instruction processes several capsules.
#[derive(Default)]
pub(super) struct OutlineBlock {
    count: usize,
    arcs: [ArcLanes; 2],
    tangents: [TangentLanes; 2],
    extent: [Lane<f32>; 4],
}

/// A structure of arrays, one lane per capsule.
macro_rules! lanes {
    ($lanes:ident of $whole:ident { $($field:ident),* }) => {
        #[derive(Default)]
        struct $lanes {
            $($field: Lane<f32>,)*
        }

        impl $lanes {
            #[inline(always)]
            fn put(&mut self, i: usize, whole: $whole) {
                $(self.$field[i] = whole.$field;)*
            }

            #[inline(always)]
            fn get(&self, i: usize) -> $whole {
                $whole { $($field: self.$field[i]),* }
            }
        }
    };
}
lanes!(ArcLanes of Arc { centre_x, centre_y, radius, shear, half_width });
lanes!(TangentLanes of Tangent { x_a, y_a, x_b, y_b, slope });

impl OutlineBlock {
    /// Computes the outlines of a block of capsules, all of them beyond the near plane.
    #[inline(always)]
    pub(super) fn project(&mut self, capsules: &CapsuleBlock, pinhole: &Pinhole) {
        self.count = capsules.count;
        // Whole vectors: results of unused lanes are computed but never read.
        let lanes = capsules.count.next_multiple_of(4).min(BLOCK);
        for i in 0..lanes {
            let a = [capsules.a[0][i], capsules.a[1][i], capsules.a[2][i]];
            let b = [capsules.b[0][i], capsules.b[1][i], capsules.b[2][i]];
            let outline = outline(a, capsules.radius_a[i], b, capsules.radius_b[i], pinhole);
            self.arcs[0].put(i, outline.arcs[0]);
            self.arcs[1].put(i, outline.arcs[1]);
            self.tangents[0].put(i, outline.tangents[0]);
            self.tangents[1].put(i, outline.tangents[1]);
            self.extent[0][i] = outline.left;
            self.extent[1][i] = outline.top;
            self.extent[2][i] = outline.right;
            self.extent[3][i] = outline.bottom;
        }
    }

    pub(super) fn count(&self) -> usize {
        self.count.min(BLOCK)
    }

    /// The outline of lane `i < BLOCK`.
    #[inline(always)]
    pub(super) fn get(&self, i: usize) -> Outline {
        Outline {
            arcs: [self.arcs[0].get(i), self.arcs[1].get(i)],
            tangents: [self.tangents[0].get(i), self.tangents[1].get(i)],
            left: self.extent[0][i],
            top: self.extent[1][i],
            right: self.extent[2][i],
            bottom: self.extent[3][i],
        }
    }
}

/// The outline of one capsule beyond the near plane. Straight-line code, so that it can be vectorised.
#[inline(always)]
fn outline(a: [f64; 3], radius_a: f64, b: [f64; 3], radius_b: f64, pinhole: &Pinhole) -> Outline {
    let (arc_a, arc_b) = (arc(a, radius_a, pinhole), arc(b, radius_b, pinhole));
    let (reach_a, reach_b) = (arc_a.reach(), arc_b.reach());
    let w = cross(a, b);
    let q = [radius_a * b[0] - radius_b * a[0], radius_a * b[1] - radius_b * a[1], radius_a * b[2] - radius_b * a[2]];
    let across = cross(q, w);
    let w2 = dot(w, w);
    let inverse = 1.0 / w2;
    // NaN, and therefore no tangent, if one outline contains the other.
    let root = (w2 - dot(q, q)).sqrt() * inverse;
    let middle = scaled(across, inverse);
    let normals = [plus(middle, scaled(w, root)), plus(middle, scaled(w, -root))];
    Outline {
        arcs: [arc_a, arc_b],
        tangents: [
            tangent(contact(a, radius_a, normals[0], pinhole), contact(b, radius_b, normals[0], pinhole)),
            tangent(contact(a, radius_a, normals[1], pinhole), contact(b, radius_b, normals[1], pinhole)),
        ],
        left: lower(arc_a.centre_x - reach_a, arc_b.centre_x - reach_b),
        top: lower(arc_a.centre_y - arc_a.radius, arc_b.centre_y - arc_b.radius),
        right: upper(arc_a.centre_x + reach_a, arc_b.centre_x + reach_b),
        bottom: upper(arc_a.centre_y + arc_a.radius, arc_b.centre_y + arc_b.radius),
    }
}

#[inline(always)]
fn tangent([x_a, y_a]: [f32; 2], [x_b, y_b]: [f32; 2]) -> Tangent {
    Tangent { x_a, y_a, x_b, y_b, slope: (x_b - x_a) / (y_b - y_a) }
}

#[inline(always)]
fn arc([x, y, z]: [f64; 3], radius: f64, pinhole: &Pinhole) -> Arc {
    let ([fx, fy], [cx, cy]) = (pinhole.focal, pinhole.principal_point);
    let l = (z - radius) * (z + radius);
    let k1 = y * y + l;
    let k = x * x + k1;
    let inverse = 1.0 / (l * k1);
    let (over_l, over_k1) = (k1 * inverse, l * inverse);
    let aspect = fx / fy;
    Arc {
        centre_x: (fx * (x * z * over_l) + cx) as f32,
        centre_y: (fy * (y * z * over_l) + cy) as f32,
        radius: (fy * radius * k1.sqrt() * over_l) as f32,
        shear: (aspect * x * y * over_k1) as f32,
        half_width: (aspect * (k * l).sqrt() * over_k1) as f32,
    }
}

/// Pixel where the plane with unit normal `normal` touches a ball.
#[inline(always)]
fn contact(centre: [f64; 3], radius: f64, normal: [f64; 3], pinhole: &Pinhole) -> [f32; 2] {
    let ([fx, fy], [cx, cy]) = (pinhole.focal, pinhole.principal_point);
    let point = plus(centre, scaled(normal, -radius));
    let inverse = 1.0 / point[2];
    [(fx * (point[0] * inverse) + cx) as f32, (fy * (point[1] * inverse) + cy) as f32]
}

#[inline(always)]
fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn scaled(a: [f64; 3], factor: f64) -> [f64; 3] {
    [a[0] * factor, a[1] * factor, a[2] * factor]
}

#[inline(always)]
fn plus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// The lesser of two numbers, `b` if they cannot be compared. (`f32::min` takes two more instructions.)
#[inline(always)]
pub(super) fn lower(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The greater of two numbers, `b` if they cannot be compared.
#[inline(always)]
pub(super) fn upper(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// An outline prepared for row queries.
pub(super) struct RowSpans {
    arcs: [Arc; 2],
    edges: [TangentEdge; 2],
    width: f32,
}

impl RowSpans {
    /// Spans in an image of `width` pixels.
    #[inline(always)]
    pub(super) fn new(outline: &Outline, width: f32) -> Self {
        Self { arcs: outline.arcs, edges: outline.tangents.map(TangentEdge::new), width }
    }

    /// Starts and ends (pixels set are `start..end`) in the rows with these centres; empty if there is none or the
    /// centre is NaN. A pixel whose centre is exactly on the outline may be counted as inside or outside.
    #[inline(always)]
    pub(super) fn rows(&self, centres: &Rows<f32>) -> [Rows<u32>; 2] {
        let (mut starts, mut ends) = ([0; ROWS], [0; ROWS]);
        for ((&y, start), end) in centres.iter().zip(&mut starts).zip(&mut ends) {
            let [left_a, right_a] = self.arcs[0].crossings(y);
            let [left_b, right_b] = self.arcs[1].crossings(y);
            let (x_a, x_b) = (self.edges[0].crossing(y), self.edges[1].crossing(y));
            // Every crossing is in the hull and NaN means none, so the hull is between the outermost crossings.
            let left = lower(x_a, lower(x_b, lower(left_a, lower(left_b, f32::INFINITY))));
            let right = upper(x_a, upper(x_b, upper(right_a, upper(right_b, f32::NEG_INFINITY))));
            *start = nearest_integer(lower(upper(left, 0.0), self.width));
            *end = nearest_integer(lower(upper(right, 0.0), self.width));
        }
        [starts, ends]
    }
}

impl Outline {
    /// Whether all of it is nearer to pixel (0, 0) than `limit`; false if a number is NaN.
    #[inline(always)]
    pub(super) fn is_within(&self, limit: f32) -> bool {
        self.left > -limit && self.right < limit && self.top > -limit && self.bottom < limit
    }
}

impl Arc {
    /// An upper bound of its extent to the left and right of its centre.
    #[inline(always)]
    fn reach(&self) -> f32 {
        self.radius * (self.shear.abs() + self.half_width)
    }

    #[inline(always)]
    fn crossings(&self, y: f32) -> [f32; 2] {
        let d = y - self.centre_y;
        let half = self.half_width * ((self.radius - d) * (self.radius + d)).sqrt();
        let middle = self.centre_x + self.shear * d;
        [middle - half, middle + half]
    }
}

/// A tangent prepared for row crossings.
struct TangentEdge {
    x: f32,
    y: f32,
    slope: f32,
    low: [f32; 2],
    high: [f32; 2],
}

impl TangentEdge {
    #[inline(always)]
    fn new(tangent: Tangent) -> Self {
        let Tangent { x_a, y_a, x_b, y_b, slope } = tangent;
        let low = [lower(x_a, x_b), lower(y_a, y_b)];
        Self { x: x_a, y: y_a, slope, low, high: [upper(x_a, x_b), upper(y_a, y_b)] }
    }

    #[inline(always)]
    fn crossing(&self, y: f32) -> f32 {
        // Horizontal tangents have an infinite slope: the ends bound the result.
        let x = upper(lower(self.x + self.slope * (y - self.y), self.high[0]), self.low[0]);
        if (y - self.low[1]) * (self.high[1] - y) >= 0.0 { x } else { f32::NAN }
    }
}

/// Rounds a number in `0.0..=2^22` to the nearest integer: adding 2^23 leaves the integer in the low mantissa bits.
#[inline(always)]
fn nearest_integer(x: f32) -> u32 {
    const SHIFT: f32 = 8_388_608.0;
    (x + SHIFT).to_bits().wrapping_sub(SHIFT.to_bits())
}
