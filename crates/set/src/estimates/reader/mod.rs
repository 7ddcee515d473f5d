//! Reads `poses.npz` of any program: columns are matched by name, NaN means no estimate.

use nalgebra::{DVector, Isometry3, Point3};

#[doc(hidden)]
pub use self::seed_axis::with_seed_axis;
use super::{Articulation, EstimatedSequence, Estimates, FARTHEST_M, Position};
use crate::SetError;
use crate::format::rigid;
use skiagraph_core::body::{Humanoid, LANDMARKS, Markers, Pose};
use skiagraph_core::npz::Npz;

mod seed_axis;

/// Tolerance between two values of one position, metres: above the rounding of single precision far out.
const AGREEMENT_M: f64 = 0.001;
/// Greatest joint angle, radians, or displacement of a sliding joint, metres.
const FARTHEST_ANGLE: f64 = 1e6;
/// Characters of a name that a message quotes.
const QUOTED: usize = 60;
/// Longest list of known names in a message, characters.
const LISTED: usize = 250;

impl Estimates {
    /// The estimates of a `poses.npz` for the tracker's body. The arrays are described in `docs/estimates.md`: numbers
    /// of any type, named columns in any order, NaN for a missing estimate.
    ///
    /// # Errors
    /// [`SetError::Malformed`] naming the array and the column, or the seed and frame, that is invalid.
    pub fn from_bytes(file: &str, bytes: &[u8], body: &Humanoid) -> Result<Self, SetError> {
        Self::from_bodies(file, bytes, body, Vec::new())
    }

    /// As [`Self::from_bytes`], with one body per seed for its poses; `bodies` must have the joints and degrees of
    /// freedom of `body`. If `bodies` is empty, all poses are of `body`.
    ///
    /// # Errors
    /// [`SetError::Malformed`] as there, and if the bodies do not fit.
    pub fn from_bodies(file: &str, bytes: &[u8], body: &Humanoid, bodies: Vec<Humanoid>) -> Result<Self, SetError> {
        Self::from_npz(file, Npz::from_bytes(file, bytes)?, body, bodies)
    }

    /// As [`Self::from_bodies`], for an archive that was read before.
    ///
    /// # Errors
    /// As [`Self::from_bodies`].
    #[doc(hidden)]
    pub fn from_npz(file: &str, npz: Npz, body: &Humanoid, bodies: Vec<Humanoid>) -> Result<Self, SetError> {
        let npz = with_seed_axis(file, npz)?;
        let refuse = |detail: &str| SetError::malformed(file, detail);
        let rate = if npz.get("fps").is_some_and(|fps| fps.shape == [1]) { &[Some(1)][..] } else { &[] };
        if npz.get("fps").is_none() {
            return Err(refuse("has no array \"fps\": add the rate of the estimates, frames per second, as fps=60.0"));
        }
        let frames_per_second = npz.numbers(file, "fps", rate)?[0];
        let seeds: Result<Vec<u64>, _> = npz.whole_numbers(file, "seeds")?.into_iter().map(u64::try_from).collect();
        let seeds = seeds.map_err(|_| refuse("seeds: expected integers >= 0"))?;
        let first = ["estimate_root", "estimate_markers", "estimate_joints"].into_iter().find_map(|name| npz.get(name));
        let first = first.ok_or_else(|| {
            refuse(
                "contains no estimate; expected estimate_root and estimate_angles, or estimate_markers with marker_names, or \
                 estimate_joints with estimate_joint_names",
            )
        })?;
        let frames = first.shape.get(1).copied().unwrap_or(0);
        if seeds.is_empty() || frames == 0 {
            return Err(refuse("contains no frame"));
        }
        check_bodies(body, &bodies, seeds.len()).map_err(|detail| refuse(&detail))?;
        let mut reader =
            EstimatesReader { file, npz: &npz, body, bodies: &bodies, seeds: &seeds, frames, notes: Vec::new() };
        let sequences = reader.sequences()?;
        let notes = reader.notes;
        Ok(Self { frames_per_second, seeds, sequences, bodies, notes })
    }
}

fn check_bodies(body: &Humanoid, bodies: &[Humanoid], seeds: usize) -> Result<(), String> {
    if !bodies.is_empty() && bodies.len() != seeds {
        return Err(format!("{} bodies for {seeds} seeds; expected one per seed", bodies.len()));
    }
    let names = |of: &Humanoid| {
        let degrees: Vec<String> = of.degrees_of_freedom.iter().map(|degree| degree.name.clone()).collect();
        (degrees, of.joints.iter().map(|joint| joint.name.clone()).collect::<Vec<_>>())
    };
    if bodies.iter().all(|of| names(of) == names(body)) {
        Ok(())
    } else {
        Err(format!("the joints of its bodies differ from those of the set's tracker body {:?}", body.name))
    }
}

struct EstimatesReader<'a> {
    file: &'a str,
    npz: &'a Npz,
    body: &'a Humanoid,
    /// One per seed, or empty.
    bodies: &'a [Humanoid],
    seeds: &'a [u64],
    frames: usize,
    notes: Vec<String>,
}

fn is_in_range(place: &[f64]) -> bool {
    place.iter().all(|coordinate| coordinate.abs() <= FARTHEST_M)
}

fn too_far(what: &str, place: &[f64]) -> String {
    format!(
        "{what} is at {place:?}; expected at most {FARTHEST_M} m from the origin along each axis; check the unit, and use \
         NaN for frames without an estimate"
    )
}

/// Positions of named points, one row for every frame of every seed.
struct PointColumns {
    /// Index of the known point of every column.
    points: Vec<usize>,
    places: Vec<Position>,
}

impl PointColumns {
    fn row(&self, row: usize) -> impl Iterator<Item = (usize, Position)> {
        let width = self.points.len();
        self.points.iter().copied().zip(self.places[row * width..(row + 1) * width].iter().copied())
    }
}

/// The names that columns may have.
struct KnownNames<'a> {
    names: Vec<&'a str>,
    /// What the names are, as in `"x" is not ...`.
    kind: &'static str,
    /// Whether every name needs a column.
    all: bool,
}

impl EstimatesReader<'_> {
    fn sequences(&mut self) -> Result<Vec<EstimatedSequence>, SetError> {
        let roots = self.roots()?;
        let angles = self.angles(roots.as_deref())?;
        let landmarks =
            KnownNames { names: LANDMARKS.map(|l| l.name()).to_vec(), kind: "a marker of HumanEva", all: false };
        let markers = self.places("estimate_markers", "marker_names", &landmarks)?;
        let names = self.body.joints.iter().map(|joint| joint.name.as_str()).collect();
        let joints = KnownNames { names, kind: "a joint of the tracker's body (start/body.json)", all: false };
        let joints = self.places("estimate_joints", "estimate_joint_names", &joints)?;
        let poses = match (&roots, angles) {
            (Some(roots), Some(angles)) => Some(self.poses(roots, angles)?),
            _ => None,
        };
        let given = EstimateArrays {
            markers,
            joints,
            roots: roots.as_deref().filter(|_| poses.is_none()),
            poses: poses.as_deref(),
        };
        self.check_markers(&given)?;
        let mut found = Vec::with_capacity(self.seeds.len());
        for (index, _) in self.seeds.iter().enumerate() {
            let rows = index * self.frames..(index + 1) * self.frames;
            let markers = rows.clone().map(|row| self.markers(&given, row)).collect::<Result<_, _>>()?;
            let articulation = match (&poses, &roots) {
                (Some(poses), _) => Articulation::Poses(poses[rows.clone()].to_vec()),
                (None, Some(roots)) => Articulation::Roots(roots[rows.clone()].to_vec()),
                (None, None) => Articulation::Unknown,
            };
            found.push(EstimatedSequence { articulation, markers });
        }
        Ok(found)
    }

    fn roots(&self) -> Result<Option<Vec<Option<Isometry3<f64>>>>, SetError> {
        const NAME: &str = "estimate_root";
        if self.npz.get(NAME).is_none() {
            return Ok(None);
        }
        let numbers = self.numbers(NAME, &[Some(7)])?;
        let root = |(row, numbers): (usize, &[f64; 7])| match self.is_given(NAME, row, numbers)? {
            true if !is_in_range(&numbers[..3]) => Err(self.refuse_row(NAME, row, &too_far("the root", &numbers[..3]))),
            true => rigid::from_rounded_row(numbers).map(Some).map_err(|e| self.refuse_row(NAME, row, &e)),
            false => Ok(None),
        };
        numbers.as_chunks::<7>().0.iter().enumerate().map(root).collect::<Result<_, _>>().map(Some)
    }

    fn angles(
        &mut self,
        roots: Option<&[Option<Isometry3<f64>>]>,
    ) -> Result<Option<Vec<Option<DVector<f64>>>>, SetError> {
        const NAME: &str = "estimate_angles";
        if self.npz.get(NAME).is_none() {
            return Ok(None);
        }
        let roots = roots.ok_or_else(|| self.refuse("estimate_angles needs estimate_root"))?;
        let degrees = self.body.degrees_of_freedom.len();
        let numbers = self.numbers(NAME, &[Some(degrees)])?;
        let names = self.body.degrees_of_freedom.iter().map(|degree| degree.name.as_str()).collect();
        let known =
            KnownNames { names, kind: "a degree of freedom of the tracker's body (start/start.json)", all: true };
        let order = match self.npz.names(self.file, "estimate_angle_names")? {
            Some(names) => self.order("estimate_angle_names", names, &known)?,
            None => {
                let note = "has no estimate_angle_names; assuming the order of angle_names in start/start.json";
                self.notes.push(format!("{} {note}", self.file));
                (0..degrees).collect()
            }
        };
        let of_row = |row: usize| {
            let found = &numbers[row * degrees..(row + 1) * degrees];
            // a body without joints has an estimate wherever its root has one
            let given = if degrees == 0 { roots[row].is_some() } else { self.is_given(NAME, row, found)? };
            if given && found.iter().any(|angle| angle.abs() > FARTHEST_ANGLE) {
                let detail = format!(
                    "an angle is beyond {FARTHEST_ANGLE} radians, or a sliding joint beyond {FARTHEST_ANGLE} metres"
                );
                return Err(self.refuse_row(NAME, row, &detail));
            }
            let mut angles = DVector::zeros(degrees);
            order.iter().zip(found).for_each(|(degree, angle)| angles[*degree] = *angle);
            Ok(given.then_some(angles))
        };
        (0..roots.len()).map(of_row).collect::<Result<_, _>>().map(Some)
    }

    fn poses(
        &self,
        roots: &[Option<Isometry3<f64>>],
        angles: Vec<Option<DVector<f64>>>,
    ) -> Result<Vec<Option<Pose>>, SetError> {
        let both = roots.iter().zip(angles).enumerate();
        let pose = both.map(|(row, (root, angles))| match (*root, angles) {
            (Some(world_from_root), Some(joint_angles)) => Ok(Some(Pose { world_from_root, joint_angles })),
            (None, None) => Ok(None),
            _ => Err(self.refuse_row(
                "estimate_root",
                row,
                "only one of root and angles is NaN; in a frame without an estimate both must be NaN",
            )),
        });
        pose.collect()
    }

    /// The positions of an array with named columns.
    fn places(&self, name: &str, names_array: &str, known: &KnownNames<'_>) -> Result<Option<PointColumns>, SetError> {
        if self.npz.get(name).is_none() {
            return Ok(None);
        }
        let names = self.npz.names(self.file, names_array)?;
        let names =
            names.ok_or_else(|| self.refuse(&format!("{name} needs {names_array}, the names of its columns")))?;
        let points = self.order(names_array, names, known)?;
        let numbers = self.numbers(name, &[Some(points.len()), Some(3)])?;
        let place = |(index, numbers): (usize, &[f64; 3])| match self.is_given(name, index / points.len(), numbers) {
            Ok(true) if !is_in_range(numbers) => {
                let what = format!("{:?}", names[index % points.len()]);
                Err(self.refuse_row(name, index / points.len(), &too_far(&what, numbers)))
            }
            Ok(given) => Ok(given.then(|| Point3::from(*numbers))),
            Err(_) => {
                let detail = format!(
                    "{:?} is {numbers:?}; expected three finite numbers or three NaN",
                    names[index % points.len()]
                );
                Err(self.refuse_row(name, index / points.len(), &detail))
            }
        };
        let places = numbers.as_chunks::<3>().0.iter().enumerate().map(place).collect::<Result<_, _>>()?;
        Ok(Some(PointColumns { points, places }))
    }

    /// Index of every name among the known ones.
    fn order(&self, array: &str, names: &[String], known: &KnownNames<'_>) -> Result<Vec<usize>, SetError> {
        let quoted = |name: &str| format!("{:?}", name.chars().take(QUOTED).collect::<String>());
        let mut taken = vec![false; known.names.len()];
        let mut order = Vec::new();
        for name in names {
            let Some(index) = known.names.iter().position(|known| known == name) else {
                let names = known.names.join(", ");
                // a longer list is in the file that the kind names
                let expected = if names.len() <= LISTED { format!("; expected {names}") } else { String::new() };
                return Err(self.refuse(&format!("{array}: {} is not {}{expected}", quoted(name), known.kind)));
            };
            if std::mem::replace(&mut taken[index], true) {
                return Err(self.refuse(&format!("{array}: {} appears twice", quoted(name))));
            }
            order.push(index);
        }
        let missing = taken.iter().position(|taken| !taken).filter(|_| known.all || names.is_empty());
        match missing {
            Some(index) => {
                let (name, kind) = (quoted(known.names[index]), known.kind);
                Err(self.refuse(&format!("{array}: {name} is missing; it is {kind}")))
            }
            None => Ok(order),
        }
    }

    fn body_of(&self, row: usize) -> &Humanoid {
        self.bodies.get(row / self.frames).unwrap_or(self.body)
    }

    /// The marker positions in one frame, from all sources.
    fn markers(&self, given: &EstimateArrays<'_>, row: usize) -> Result<Markers, SetError> {
        let mut found: Markers = [None; LANDMARKS.len()];
        let mut source = "";
        if let Some(pose) = given.poses.and_then(|poses| poses[row].as_ref()) {
            let body = self.body_of(row);
            found = body.markers(&body.link_frames(pose));
            source = "estimate_root and estimate_angles";
        }
        for (landmark, place) in given.markers.iter().flat_map(|columns| columns.row(row)) {
            self.put(&mut found, landmark, place, row, ["estimate_markers", source])?;
        }
        source = if source.is_empty() { "estimate_markers" } else { source };
        for (joint, place) in given.joints.iter().flat_map(|columns| columns.row(row)) {
            for landmark in self.body_of(row).markers_on_joint(joint) {
                self.put(&mut found, landmark, place, row, ["estimate_joints", source])?;
            }
        }
        if let Some(root) = given.roots.and_then(|roots| roots[row]) {
            for (landmark, point) in self.body_of(row).markers_on_root() {
                let has_column = given.markers.as_ref().is_some_and(|columns| columns.points.contains(&landmark));
                found[landmark] = found[landmark].or((!has_column).then(|| root * point));
            }
        }
        Ok(found)
    }

    fn put(
        &self,
        found: &mut Markers,
        landmark: usize,
        place: Position,
        row: usize,
        [array, before]: [&str; 2],
    ) -> Result<(), SetError> {
        let Some(place) = place else { return Ok(()) };
        let apart = found[landmark].map_or(0.0, |there| (there - place).norm());
        if apart > AGREEMENT_M {
            let detail = format!(
                "{} is {:.1} mm from its position by {before}; leave out one of the two, or make them agree",
                LANDMARKS[landmark].name(),
                1000.0 * apart
            );
            return Err(self.refuse_row(array, row, &detail));
        }
        found[landmark] = found[landmark].or(Some(place));
        Ok(())
    }

    /// Notes which markers the file lacks, unless it has poses.
    ///
    /// # Errors
    /// [`SetError`] if it gives joints alone, none of which is at a marker.
    fn check_markers(&mut self, given: &EstimateArrays<'_>) -> Result<(), SetError> {
        if given.poses.is_some() {
            return Ok(());
        }
        let by_markers = given.markers.iter().flat_map(|columns| columns.points.iter().copied());
        let by_joints =
            given.joints.iter().flat_map(|columns| &columns.points).flat_map(|j| self.body.markers_on_joint(*j));
        let by_root = given.roots.into_iter().flat_map(|_| self.body.markers_on_root().map(|(landmark, _)| landmark));
        let mut has = [false; LANDMARKS.len()];
        by_markers.chain(by_joints).chain(by_root).for_each(|landmark| has[landmark] = true);
        let absent = LANDMARKS.iter().zip(has).filter(|(_, has)| !has).map(|(landmark, _)| landmark.name());
        let absent: Vec<&str> = absent.collect();
        let count = LANDMARKS.len() - absent.len();
        if count == 0 {
            return Err(self.refuse(&self.no_joint_at_a_marker()));
        }
        if !absent.is_empty() {
            self.notes.push(format!(
                "{} gives {count} of the {} markers; missing: {}",
                self.file,
                LANDMARKS.len(),
                absent.join(", ")
            ));
        }
        Ok(())
    }

    fn no_joint_at_a_marker(&self) -> String {
        let (at, off): (Vec<usize>, Vec<usize>) =
            (0..self.body.joints.len()).partition(|joint| self.body.markers_on_joint(*joint).next().is_some());
        let names = |joints: &[usize]| {
            let names = joints.iter().filter_map(|joint| self.body.joints.get(*joint)).map(|joint| joint.name.as_str());
            names.collect::<Vec<_>>().join(", ")
        };
        format!(
            "estimate_joint_names: estimates are measured at markers, and none of its joints is at one; the joints of the \
             tracker's body at a marker: {}; without: {}",
            names(&at),
            names(&off)
        )
    }

    /// The numbers of an array whose first axes are seeds and frames.
    fn numbers(&self, name: &str, rest: &[Option<usize>]) -> Result<Vec<f64>, SetError> {
        let shape = self.npz.get(name).map(|array| array.shape.as_slice()).unwrap_or_default();
        if shape.len() != 2 + rest.len() {
            // with a wrong number of axes the intended lengths are unknown
            let rest = rest.iter().map(|length| length.map_or("any".to_owned(), |length| length.to_string()));
            let seeds = format!("{} seed(s)", self.seeds.len());
            let expected: Vec<String> = [seeds, "frames".to_owned()].into_iter().chain(rest).collect();
            return Err(self.refuse(&format!("{name}: shape {shape:?}, expected [{}]", expected.join(", "))));
        }
        Ok(self.npz.numbers(self.file, name, &[&[Some(self.seeds.len()), Some(self.frames)], rest].concat())?)
    }

    /// Whether a row has an estimate: all numbers finite, or all NaN.
    fn is_given(&self, name: &str, row: usize, numbers: &[f64]) -> Result<bool, SetError> {
        if numbers.iter().all(|number| number.is_finite()) {
            return Ok(true);
        }
        match numbers.iter().position(|number| !number.is_nan()) {
            None => Ok(false),
            Some(column) => {
                let detail = format!(
                    "expected only finite numbers, or only NaN for a frame without an estimate; column {column} is {}",
                    numbers[column]
                );
                Err(self.refuse_row(name, row, &detail))
            }
        }
    }

    fn refuse(&self, detail: &str) -> SetError {
        SetError::malformed(self.file, detail)
    }

    fn refuse_row(&self, name: &str, row: usize, detail: &str) -> SetError {
        let (seed, frame) = (self.seeds[row / self.frames], row % self.frames);
        self.refuse(&format!("{name}: seed {seed}, frame {frame}: {detail}"))
    }
}

/// The contents of a file, one row per frame of every seed.
struct EstimateArrays<'a> {
    poses: Option<&'a [Option<Pose>]>,
    markers: Option<PointColumns>,
    joints: Option<PointColumns>,
    /// If there are no poses.
    roots: Option<&'a [Option<Isometry3<f64>>]>,
}

#[cfg(test)]
mod tests;
