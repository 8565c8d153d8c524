//! Statistics of the map of the air: correlations in space and time, the field behind them, wind and
//! averaging times.

pub mod result;
