//! Checks of a graph assembled from storage.

use super::graph::GpdmGraph;
use crate::motion_model::gpdm::PartsError;

impl GpdmGraph {
    /// Checks that the graph's parts are consistent: segments in the order of the training frames, with one latent,
    /// error and set of rotations per frame; candidates that exist.
    pub fn checked(self) -> Result<Self, PartsError> {
        if !(self.frames_per_second > 0.0 && self.frames_per_second.is_finite()) {
            let detail = format!("expected a number above zero, found {}", self.frames_per_second);
            return Err(PartsError::new("frames a second", detail));
        }
        let (mut last, mut end) = (0, 0);
        for segment in &self.segments {
            let range = segment.range;
            let begins_well = (range.motion == last && range.first == end) || (range.motion > last && range.first == 0);
            if !begins_well || range.first >= range.end {
                return Err(PartsError::new("segments", "expected ranges in the order of the training frames"));
            }
            (last, end) = (range.motion, range.end);
            self.check_lengths(segment)?;
        }
        let exists = |c: &super::Candidate| self.segments.get(c.segment).is_some_and(|s| c.row < s.errors.len());
        if self.candidates.iter().all(exists) {
            Ok(self)
        } else {
            Err(PartsError::new("candidates", "expected existing models and frames of the graph"))
        }
    }

    fn check_lengths(&self, segment: &super::GraphSegment) -> Result<(), PartsError> {
        let frames = segment.range.end - segment.range.first;
        let joints = self.chart.groups().len();
        let fits = segment.gpdm.layout().lengths == [frames]
            && segment.gpdm.scales().len() == self.chart.dimensions()
            && segment.errors.len() == frames
            && segment.rotations.len() == frames
            && segment.rotations.iter().all(|r| r.len() == joints);
        if fits {
            Ok(())
        } else {
            Err(PartsError::new("segments", format!("expected {frames} frames of {joints} joints in each part")))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Candidate, GraphSettings};
    use super::*;
    use crate::motion_model::pose_chart::tests::swinging;
    use skiagraph_core::body::Humanoid;

    #[test]
    fn a_learned_graph_is_valid_and_a_graph_with_a_part_of_another_is_not() {
        let body = Humanoid::tracker25().unwrap();
        let mut settings = GraphSettings::default();
        settings.training.rounds = 1;
        let graph = GpdmGraph::learn(&body, &[swinging(&body, 35)], &settings).unwrap();
        assert_eq!(graph.clone().checked().unwrap(), graph);
        type GraphFault<'a> = (&'a str, &'a dyn Fn(&mut GpdmGraph));
        let broken: [GraphFault<'_>; 5] = [
            ("frames a second", &|g| g.frames_per_second = f64::NAN),
            ("segments", &|g| g.segments[0].range.first = 1),
            ("segments", &|g| g.segments[0].errors.truncate(9)),
            ("segments", &|g| g.segments[0].rotations[3].clear()),
            ("candidates", &|g| g.candidates.push(Candidate { segment: 0, row: 35 })),
        ];
        for (name, break_it) in broken {
            let mut graph = graph.clone();
            break_it(&mut graph);
            assert_eq!(graph.checked().unwrap_err().part, name);
        }
    }
}
