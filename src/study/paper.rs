//! Results that the paper states for its simulations ("Thermal Updraft Profiling with an Array of
//! Show Drones", Table I and section III-A).

use crate::base::estimate::Estimate;

/// Table I: A, us/(m/s)².
pub const A: Estimate = Estimate { value: 8.207, se: 0.020 };
/// Table I: u0, us.
pub const U0_US: Estimate = Estimate { value: 1598.656, se: 0.039 };
/// Table I: W*, m/s.
pub const W_MPS: Estimate = Estimate { value: -0.0589, se: 0.0031 };
/// Pearson's rho over the updrafts of a condition, lowest and highest.
pub const RHO: [f64; 2] = [0.9996, 0.99999];
/// p-values that the paper states for [`RHO`], lowest and highest. With n = 11 that rho would have
/// p-values of 2e-22 to 3e-15.
pub const P_VALUE: [f64; 2] = [1e-26, 1e-11];
/// Number of updrafts in each condition.
pub const N: usize = 11;
