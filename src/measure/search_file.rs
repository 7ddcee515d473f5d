//! `search.npz`: how this program's trackers searched.
//!
//! | array | shape | meaning |
//! |---|---|---|
//! | `energy` | (S, T) | energy of the estimate; NaN if there is none |
//! | `evaluations` | (S, T) | likelihood evaluations |
//! | `layers` | (S, T, L, 6) | one row per annealing layer, columns `layer_columns`; NaN in frames without a search |
//! | `by_search` | (S, T) | 1 if particles and limbs found a clearly better pose than the descents before |
//! | `occupancy` | (S, T, K, 3) | one row per motion model, columns `occupancy_columns`; K = 0 without such models |

use std::path::Path;

use crate::common::{ExperimentError, read_file};
use skiagraph_core::input::limits;
use skiagraph_core::npz::{Array, Npz, Values};
use skiagraph_track::motion_model::ModelOccupancy;
use skiagraph_track::tracker::LayerRecord;

const LAYER_COLUMNS: [&str; 6] =
    ["lambda", "effective_sample_size", "energy_min", "energy_mean", "energy_std", "degenerate"];

#[derive(Clone, Debug, PartialEq)]
pub struct SearchRecord {
    pub energy: Option<f64>,
    pub evaluations: u64,
    /// One entry per annealing layer; empty in a frame without a search.
    pub layers: Vec<LayerRecord>,
    /// Whether the search of particles and limbs found a clearly better pose than the descents before it.
    pub by_search: bool,
    /// One entry per motion model, for trackers in latent spaces.
    pub occupancy: Vec<ModelOccupancy>,
}

pub(crate) fn search_to_npz(search: &[Vec<SearchRecord>]) -> Npz {
    let (seeds, frames) = (search.len(), search.first().map_or(0, Vec::len));
    let all = || search.iter().flatten();
    let layers = all().map(|r| r.layers.len()).max().unwrap_or(0);
    let row = |l: &LayerRecord| {
        let degenerate = if l.degenerate { 1.0 } else { 0.0 };
        [l.lambda, l.effective_sample_size, l.energy_min, l.energy_mean, l.energy_std, degenerate]
    };
    // frames with fewer layers are padded with rows of NaN
    let rows = |r: &SearchRecord| {
        let missing = layers - r.layers.len();
        r.layers.iter().map(row).chain(std::iter::repeat_n([f64::NAN; 6], missing)).collect::<Vec<_>>()
    };
    let models = all().map(|r| r.occupancy.len()).max().unwrap_or(0);
    let in_model = |m: &ModelOccupancy| [f64::from(m.particles), m.weight, f64::from(m.recovered)];
    let in_models = |r: &SearchRecord| {
        let missing = models - r.occupancy.len();
        r.occupancy.iter().map(in_model).chain(std::iter::repeat_n([0.0; 3], missing)).collect::<Vec<_>>()
    };
    let energies: Vec<f64> = all().map(|r| r.energy.unwrap_or(f64::NAN)).collect();
    let evaluations: Vec<i64> = all().map(|r| i64::try_from(r.evaluations).unwrap_or(i64::MAX)).collect();
    Npz::from_iter([
        ("energy", Array::new(&[seeds, frames], energies)),
        ("evaluations", Array::new(&[seeds, frames], evaluations)),
        ("layers", Array::new(&[seeds, frames, layers, 6], all().flat_map(rows).flatten().collect::<Vec<f64>>())),
        ("layer_columns", Array::names(LAYER_COLUMNS)),
        ("by_search", Array::new(&[seeds, frames], all().map(|r| i64::from(r.by_search)).collect::<Vec<i64>>())),
        (
            "occupancy",
            Array::new(&[seeds, frames, models, 3], all().flat_map(in_models).flatten().collect::<Vec<f64>>()),
        ),
        ("occupancy_columns", Array::names(["particles", "weight", "recovered"])),
    ])
}

/// Reads the search records of a run's `search.npz`. `shape`: seeds and frames of its poses.
pub(crate) fn read_search(path: &Path, shape: [usize; 2]) -> Result<Vec<Vec<SearchRecord>>, ExperimentError> {
    let npz = Npz::from_bytes(&path.display().to_string(), &read_file(path, limits::ARRAYS)?)?;
    search_from_npz(&npz, shape).ok_or_else(|| ExperimentError::Malformed {
        path: path.to_owned(),
        detail: "expected the arrays energy, evaluations and layers as `skiagraph track` writes them".to_owned(),
    })
}

/// The search records of an archive; `None` if its arrays do not have the expected types and shapes. `shape`: seeds and
/// frames of `poses.npz`.
fn search_from_npz(npz: &Npz, shape: [usize; 2]) -> Option<Vec<Vec<SearchRecord>>> {
    let Values::F64(energy) = &npz.get("energy")?.values else { return None };
    let Values::I64(evaluations) = &npz.get("evaluations")?.values else { return None };
    let array = npz.get("layers")?;
    let (Values::F64(layers), [seeds, frames, layer_count, 6]) = (&array.values, array.shape.as_slice()) else {
        return None;
    };
    let (occupancy, models) = match npz.get("occupancy") {
        None => (&[][..], 0),
        Some(array) => match (&array.values, array.shape.as_slice()) {
            (Values::F64(values), [s, f, models, 3]) if s == seeds && f == frames => (values.as_slice(), *models),
            _ => return None,
        },
    };
    // runs of earlier versions do not have it
    let by_search = match npz.get("by_search").map(|array| &array.values) {
        Some(Values::I64(values)) if values.len() == seeds * frames => Some(values),
        None => None,
        Some(_) => return None,
    };
    if [*seeds, *frames] != shape || energy.len() != seeds * frames || evaluations.len() != seeds * frames {
        return None;
    }
    let record = |index: usize| {
        let rows = layers[index * layer_count * 6..(index + 1) * layer_count * 6].as_chunks::<6>().0;
        let layers = rows.iter().filter(|row| !row[0].is_nan()).map(|row| LayerRecord {
            lambda: row[0],
            effective_sample_size: row[1],
            energy_min: row[2],
            energy_mean: row[3],
            energy_std: row[4],
            degenerate: row[5] != 0.0,
        });
        let rows = occupancy[index * models * 3..(index + 1) * models * 3].as_chunks::<3>().0;
        let in_models = rows.iter().map(|row| ModelOccupancy {
            particles: row[0] as u32,
            weight: row[1],
            recovered: row[2] as u32,
        });
        SearchRecord {
            energy: Some(energy[index]).filter(|e| !e.is_nan()),
            evaluations: u64::try_from(evaluations[index]).unwrap_or(0),
            layers: layers.collect(),
            by_search: by_search.is_some_and(|values| values[index] != 0),
            occupancy: in_models.collect(),
        }
    };
    Some((0..*seeds).map(|seed| (0..*frames).map(|frame| record(seed * frames + frame)).collect()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn search_records_are_read_back_unchanged() {
        let layer = |lambda| LayerRecord {
            lambda,
            effective_sample_size: 50.0,
            energy_min: 0.1,
            energy_mean: 0.2,
            energy_std: 0.05,
            degenerate: lambda == 0.0,
        };
        let frame = |energy, layers| SearchRecord {
            energy,
            evaluations: 300,
            by_search: energy == Some(0.5),
            layers,
            occupancy: vec![ModelOccupancy { particles: 7, weight: 0.25, recovered: 1 }; 2],
        };
        let search = vec![
            vec![frame(Some(0.25), vec![layer(1.0), layer(0.0)]), frame(None, vec![layer(3.0)])],
            vec![frame(Some(0.5), vec![]), frame(Some(0.125), vec![layer(2.0), layer(9.0)])],
        ];
        assert_eq!(search_from_npz(&search_to_npz(&search), [2, 2]), Some(search));
    }

    #[test]
    fn arrays_that_do_not_fit_together_are_refused() {
        let (layers, occupancy) = (Vec::new(), Vec::new());
        let record = SearchRecord { energy: None, evaluations: 1, layers, by_search: false, occupancy };
        let mut npz = search_to_npz(&[vec![record]]);
        assert!(search_from_npz(&npz, [1, 1]).is_some());
        assert!(search_from_npz(&npz, [1, 2]).is_none());
        npz = Npz::from_iter([
            ("energy", Array::new(&[2], vec![0.0; 2])),
            ("evaluations", Array::new(&[1], vec![1_i64])),
            ("layers", Array::new(&[1, 1, 1, 6], vec![0.0; 6])),
        ]);
        assert_eq!(search_from_npz(&npz, [1, 1]), None);
    }
}
