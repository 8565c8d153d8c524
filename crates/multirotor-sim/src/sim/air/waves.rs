//! Sums of plane waves: the kernel of all random fields.
//!
//! `v(x, t) = Σ a_m cos(2π (k_m·x + f_m t + p_m))` over some hundreds of waves. Phases are kept in
//! turns, so that the reduction to one turn is exact, and waves in blocks, so that the compiler
//! works on several at once; sums are taken lane by lane, in the same order on every machine.

use std::f64::consts::{PI, TAU};

use nalgebra::Vector3;

/// Waves per block.
const LANES: usize = 8;
/// Adding and subtracting this rounds a number below 2^51 to the nearest integer.
const ROUNDER: f64 = 1.5 * (1_u64 << 52) as f64;
/// Phases beyond this many turns are not resolved: the waves are taken at phase zero there.
const MOST_TURNS: f64 = (1_u64 << 50) as f64;

/// One wave with `N` components of velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Wave<const N: usize> {
    /// Wave vector, rad/m.
    pub(super) number_radpm: Vector3<f64>,
    /// Angular frequency at a fixed place, rad/s.
    pub(super) rate_radps: f64,
    /// Phase, turns.
    pub(super) phase_turns: f64,
    /// Amplitude of each component.
    pub(super) amplitude: [f64; N],
}

#[derive(Clone, Debug)]
struct Block<const N: usize> {
    wave: [[f64; LANES]; 3],
    rate: [f64; LANES],
    phase: [f64; LANES],
    amplitude: [[f64; LANES]; N],
}

/// A sum of waves with `N` components.
#[derive(Clone, Debug)]
pub(super) struct Waves<const N: usize> {
    blocks: Vec<Block<N>>,
}

impl<const N: usize> Waves<N> {
    /// Packs waves.
    pub(super) fn new(waves: &[Wave<N>]) -> Self {
        let blocks = waves
            .chunks(LANES)
            .map(|chunk| {
                let mut block = Block {
                    wave: [[0.0; LANES]; 3],
                    rate: [0.0; LANES],
                    phase: [0.0; LANES],
                    amplitude: [[0.0; LANES]; N],
                };
                for (lane, wave) in chunk.iter().enumerate() {
                    for axis in 0..3 {
                        block.wave[axis][lane] = wave.number_radpm[axis] / TAU;
                    }
                    block.rate[lane] = wave.rate_radps / TAU;
                    block.phase[lane] = wave.phase_turns;
                    for n in 0..N {
                        block.amplitude[n][lane] = wave.amplitude[n];
                    }
                }
                block
            })
            .collect();
        Self { blocks }
    }

    /// The sum at a place and time.
    pub(super) fn at(&self, position_m: &Vector3<f64>, time_s: f64) -> [f64; N] {
        let mut sums = [[0.0; LANES]; N];
        let [x, y, z, time_s] = [position_m.x, position_m.y, position_m.z, time_s].map(resolved);
        for block in &self.blocks {
            let mut cosine = [0.0; LANES];
            for (lane, cosine) in cosine.iter_mut().enumerate() {
                let turns = block.wave[0][lane] * x
                    + block.wave[1][lane] * y
                    + block.wave[2][lane] * z
                    + block.rate[lane] * time_s
                    + block.phase[lane];
                *cosine = cos_turns(turns);
            }
            for (sums, amplitudes) in sums.iter_mut().zip(&block.amplitude) {
                for ((sum, amplitude), cosine) in sums.iter_mut().zip(amplitudes).zip(&cosine) {
                    *sum += amplitude * cosine;
                }
            }
        }
        sums.map(|lanes| lanes.iter().sum())
    }
}

/// Coordinates so far away that phases have no digits left are taken as zero: no answer is NaN.
fn resolved(coordinate: f64) -> f64 {
    if coordinate.abs() < MOST_TURNS / 1e3 { coordinate } else { 0.0 }
}

/// Cosine of an angle in turns, to 3e-9, without branches.
fn cos_turns(turns: f64) -> f64 {
    let angle = PI * (turns - ((turns + ROUNDER) - ROUNDER));
    let square = angle * angle;
    // sin to the 13th power on [-π/2, π/2]; cos 2x = 1 - 2 sin² x.
    let series = 1.0
        + square
            * (-1.0 / 6.0
                + square
                    * (1.0 / 120.0
                        + square
                            * (-1.0 / 5_040.0
                                + square
                                    * (1.0 / 362_880.0
                                        + square
                                            * (-1.0 / 39_916_800.0
                                                + square * (1.0 / 6_227_020_800.0))))));
    let sine = angle * series;
    1.0 - 2.0 * sine * sine
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cosine_is_the_cosine() {
        for step in -20_000..20_000 {
            let turns = f64::from(step) * 0.000_731;
            assert!((cos_turns(turns) - (TAU * turns).cos()).abs() < 3e-9, "{turns}");
        }
    }

    #[test]
    fn sums_like_the_textbook() {
        let wave = |n: u32| Wave {
            number_radpm: Vector3::new(0.1, -0.02, 0.3) * f64::from(n),
            rate_radps: 0.7 * f64::from(n),
            phase_turns: 0.05 * f64::from(n),
            amplitude: [f64::from(n), -1.0],
        };
        let waves: Vec<_> = (1..=11).map(wave).collect();
        let place = Vector3::new(12.0, -7.0, 40.0);
        let mut expected = [0.0; 2];
        for wave in &waves {
            let phase = wave.number_radpm.dot(&place) + wave.rate_radps * 33.0;
            let cosine = (phase + TAU * wave.phase_turns).cos();
            expected[0] += wave.amplitude[0] * cosine;
            expected[1] += wave.amplitude[1] * cosine;
        }
        let sum = Waves::new(&waves).at(&place, 33.0);
        assert!((sum[0] - expected[0]).abs() < 1e-7 && (sum[1] - expected[1]).abs() < 1e-8);
    }
}
