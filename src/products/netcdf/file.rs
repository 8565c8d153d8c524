//! A NetCDF file that is being made: dimensions, attributes, and whole variables.

use netcdf_writer::{
    DimensionId, NcAttrValue, NcFileBuilder, NcFillValueType, NcWriteFormat, NcWriteOptions,
    VariableId,
};

use super::{Format, NetcdfError};

/// Level of deflation: the usual one.
const LEVEL: u8 = 4;
/// Most values of a chunk along one dimension.
const CHUNK: u64 = 1 << 16;

/// An attribute: its name and value.
pub(super) type Attribute<'a> = (&'a str, NcAttrValue);

/// A text as the value of an attribute.
pub(super) fn text(value: impl Into<String>) -> NcAttrValue {
    NcAttrValue::Chars(value.into())
}

/// A dimension with its length.
#[derive(Clone, Copy, Debug)]
pub(super) struct Dimension {
    id: DimensionId,
    length: u64,
}

/// A file in memory.
pub(super) struct File {
    builder: NcFileBuilder,
    format: Format,
}

impl File {
    pub(super) fn new(format: Format) -> Self {
        Self { builder: NcFileBuilder::new(), format }
    }

    pub(super) fn dimension(
        &mut self,
        name: &str,
        length: usize,
    ) -> Result<Dimension, NetcdfError> {
        let length = length as u64;
        Ok(Dimension { id: self.builder.add_dimension(name, length)?, length })
    }

    /// A global attribute; empty texts are none.
    pub(super) fn global(&mut self, name: &str, value: NcAttrValue) -> Result<(), NetcdfError> {
        if value != text("") {
            self.builder.add_attribute(name, value)?;
        }
        Ok(())
    }

    /// A variable with its values, in the order of its dimensions, and the value that stands for none.
    pub(super) fn variable<T: NcFillValueType>(
        &mut self,
        name: &str,
        dimensions: &[Dimension],
        attributes: &[Attribute<'_>],
        (values, fill): (&[T], Option<T>),
    ) -> Result<(), NetcdfError> {
        let ids: Vec<DimensionId> = dimensions.iter().map(|dimension| dimension.id).collect();
        let variable = self.builder.add_variable::<T>(name, &ids)?;
        if let Some(fill) = fill {
            self.builder.set_variable_fill_value(variable, fill)?;
        }
        self.describe(variable, dimensions, attributes)?;
        Ok(self.builder.write_variable(variable, values)?)
    }

    /// A variable of texts, each as long as the last dimension.
    pub(super) fn texts(
        &mut self,
        name: &str,
        dimensions: [Dimension; 2],
        attributes: &[Attribute<'_>],
        values: &[String],
    ) -> Result<(), NetcdfError> {
        let variable = self.builder.add_char_variable(name, &dimensions.map(|one| one.id))?;
        self.describe(variable, &dimensions, attributes)?;
        // So that readers make text of it, not bytes.
        self.builder.add_variable_attribute(variable, "_Encoding", text("utf-8"))?;
        Ok(self.builder.write_char_variable_strings(variable, values)?)
    }

    fn describe(
        &mut self,
        variable: VariableId,
        dimensions: &[Dimension],
        attributes: &[Attribute<'_>],
    ) -> Result<(), NetcdfError> {
        for (name, value) in attributes {
            self.builder.add_variable_attribute(variable, *name, value.clone())?;
        }
        if self.format == Format::Netcdf4 && !dimensions.is_empty() {
            let chunk: Vec<u64> =
                dimensions.iter().map(|dimension| dimension.length.clamp(1, CHUNK)).collect();
            self.builder.set_variable_chunking(variable, chunk)?;
            self.builder.set_variable_deflate(variable, Some(LEVEL), true)?;
        }
        Ok(())
    }

    pub(super) fn finish(self) -> Result<Vec<u8>, NetcdfError> {
        let format = match self.format {
            Format::Netcdf4 => NcWriteFormat::Nc4,
            Format::Classic => NcWriteFormat::Offset64,
        };
        let (_, bytes) = self.builder.to_vec(NcWriteOptions { format })?;
        Ok(bytes)
    }
}

/// Numbers of 32 bits, with NaN for what is not known.
pub(super) fn floats<R>(rows: &[R], get: impl Fn(&R) -> Option<f64>) -> Vec<f32> {
    rows.iter().map(|row| get(row).map_or(f32::NAN, |value| value as f32)).collect()
}

/// Length of the longest text, bytes, at least 1.
pub(super) fn longest(texts: &[String]) -> usize {
    texts.iter().map(String::len).max().unwrap_or(0).max(1)
}
