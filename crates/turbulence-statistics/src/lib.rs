#![doc = include_str!("../README.md")]
//!
//! A record ([`Record`]) is a quantity at even steps of time, in m/s for winds, with gaps where it is not known. What is
//! stated of it:
//!
//! | | | source |
//! |---|---|---|
//! | [`moments`] | variances, covariances, skewness; random and systematic errors | Lenschow, Mann and Kristensen 1994 |
//! | [`noise`] | white noise, from the autocovariance next to lag 0 | Lenschow, Wulfmeyer and Senff 2000 |
//! | [`spectrum`] | spectra, cospectra, coherence, with confidence bands | Bendat and Piersol 2010; Percival and Walden 1993 |
//! | [`dissipation`] | rate of dissipation from spectrum and structure function, if there is an inertial range | Pope 2000 |
//! | [`points`] | covariance between points by distance and lag; advection | Taylor 1938 |
//! | [`transfer`] | response of an instrument, which spectra and variances are corrected for | |
//!
//! Nothing here knows drones: a mast's or a lidar's record is as good. Errors are of sampling, of one realisation of the
//! air in a limited time; those of the instrument's scale are passed in where they matter.

pub mod autocovariance;
pub mod dissipation;
pub mod moments;
pub mod noise;
pub mod points;
pub mod quantile;
pub mod record;
pub mod spectrum;
pub mod transfer;

pub use moments::Moment;
pub use record::Record;
