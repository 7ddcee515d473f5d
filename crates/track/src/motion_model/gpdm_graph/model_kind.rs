//! Whether a learned model is the original GPDM or a graph of them.

use super::graph::GraphSettings;

/// What kind of model settings ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModelKind {
    /// The original GPDM: no segments, no candidates.
    Gpdm,
    /// A graph of GPDMs, one of each segment.
    GpdmGraph,
}

impl ModelKind {
    /// Its name, as `skiagraph train --model` spells it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gpdm => "gpdm",
            Self::GpdmGraph => "gpdm-graph",
        }
    }
}

impl GraphSettings {
    /// The default settings of a kind of model.
    pub fn from_kind(kind: ModelKind) -> Self {
        Self { single: kind == ModelKind::Gpdm, ..Self::default() }
    }

    /// What kind of model they ask for.
    pub fn kind(&self) -> ModelKind {
        if self.single { ModelKind::Gpdm } else { ModelKind::GpdmGraph }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_of_a_kind_ask_for_that_kind() {
        for kind in [ModelKind::Gpdm, ModelKind::GpdmGraph] {
            assert_eq!(GraphSettings::from_kind(kind).kind(), kind);
        }
    }
}
