//! Errors in equal parts of a sequence.

use super::Sequence;
use super::statistics::mean;

/// Greatest number of equal parts of a sequence for which the errors of markers and cameras are kept.
const TIME_PARTS: usize = 48;

/// The mean of the scored frames' values in every part of the sequence.
pub(super) fn over_time(sequence: &Sequence<'_>, values: impl Fn(usize) -> Vec<f64>) -> Vec<Option<f64>> {
    let (frames, scored) = (sequence.frames(), sequence.scored());
    let parts = TIME_PARTS.min(frames);
    let part = |part: usize| {
        let of_part = part * frames / parts..(part + 1) * frames / parts;
        mean(&of_part.filter(|frame| scored.contains(frame)).flat_map(&values).collect::<Vec<f64>>())
    };
    (0..parts).map(part).collect()
}
