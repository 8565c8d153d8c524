//! Blocks of a model's components, from its files.

use std::sync::Arc;

use super::file::File;
use crate::sim::air::gridded::{Block, Component, GridSource};

/// Faster air is a value that stands for none, whatever the file says, m/s.
const FASTEST_MPS: f64 = 200.0;

/// Files and variables of the three components.
pub(super) struct Source {
    pub(super) of: [(Arc<File>, String); 3],
}

impl GridSource for Source {
    fn read(&self, component: Component, time: usize, block: &Block) -> Result<Vec<f32>, String> {
        let (file, variable) = &self.of[component as usize];
        let values = file
            .block(variable, time, block.from, block.count)
            .map_err(|error| error.to_string())?;
        let air = |value: f64| if value.abs() <= FASTEST_MPS { value as f32 } else { f32::NAN };
        Ok(values.into_iter().map(air).collect())
    }
}
