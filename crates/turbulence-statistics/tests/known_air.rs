//! Statistics of drawn air whose spectrum is known: von Karman's and Kaimal's, carried past at a constant wind.
//!
//! Bounds are those of the share of so many seeds that an interval of 95 % may have by chance.

use rand::SeedableRng as _;
use rand_distr::{Distribution as _, StandardNormal};
use rand_pcg::Pcg64;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex64;
use turbulence_statistics::dissipation::{
    ACROSS, C1, Component, Wind, from_spectrum, from_structure,
};
use turbulence_statistics::spectrum::{Instrument, spectrum};
use turbulence_statistics::transfer::Transfer;
use turbulence_statistics::{Record, moments, noise};

const STEP_S: f64 = 0.25;
/// Ten minutes.
const COUNT: usize = 2400;
/// Means over the steps.
const MEANS: Transfer = Transfer { mean_s: STEP_S, lag_s: 0.0, gain2: Vec::new() };

/// Spectrum of air across the wind.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Law {
    /// Von Karman's (MIL-F-8785C), of an integral length along the wind.
    VonKarman,
    /// Kaimal's of the vertical component over a plain in neutral air, at a height (Kaimal and others 1972).
    Kaimal,
}

/// Air across the wind.
#[derive(Clone, Copy, Debug)]
struct Air {
    law: Law,
    sd_mps: f64,
    /// Integral length, or height.
    length_m: f64,
    wind_mps: f64,
}

const FIELD: Air = Air { law: Law::VonKarman, sd_mps: 0.5, length_m: 50.0, wind_mps: 3.0 };
const PLAIN: Air = Air { law: Law::Kaimal, length_m: 60.0, ..FIELD };

impl Air {
    /// One-sided spectral density, (m/s)²/Hz.
    fn density(&self, frequency_hz: f64) -> f64 {
        let passing_s = self.length_m / self.wind_mps;
        match self.law {
            Law::VonKarman => {
                let n = 1.339 * std::f64::consts::TAU * frequency_hz * passing_s;
                2.0 * self.sd_mps.powi(2) * passing_s * (1.0 + 8.0 / 3.0 * n * n)
                    / (1.0 + n * n).powf(11.0 / 6.0)
            }
            Law::Kaimal => {
                // n S/u*² = 2.1 n / (1 + 5.3 n^(5/3)), whose integral is 1.530.
                let n = frequency_hz * passing_s;
                self.sd_mps.powi(2) / 1.530 * passing_s * 2.1 / (1.0 + 5.3 * n.powf(5.0 / 3.0))
            }
        }
    }

    /// Integral time, s: a quarter of the density at frequency 0 over the variance.
    fn time_s(&self) -> f64 {
        0.25 * self.density(0.0) / self.sd_mps.powi(2)
    }

    /// Rate of dissipation that its spectrum has at high frequencies.
    fn dissipation(&self) -> f64 {
        let f = 1e3;
        let level = self.density(f) * f.powf(5.0 / 3.0);
        let constant = ACROSS * C1 * (self.wind_mps / std::f64::consts::TAU).powf(2.0 / 3.0);
        (level / constant).powf(1.5)
    }

    /// Density of a sampled record of an instrument with such a response: what is faster than it can show is folded back.
    fn sampled(&self, frequency_hz: f64, power: impl Fn(f64) -> f64) -> f64 {
        let rate_hz = 1.0 / STEP_S;
        let of = |frequency_hz: f64| self.density(frequency_hz) * power(frequency_hz);
        let folded = (1..40).map(|k| {
            let around = f64::from(k) * rate_hz;
            of(around - frequency_hz) + of(around + frequency_hz)
        });
        of(frequency_hz) + folded.sum::<f64>()
    }

    /// Records of it at instants.
    fn at_instants(&self) -> Spectrum {
        Spectrum::of(|frequency_hz| self.sampled(frequency_hz, |_| 1.0))
    }

    /// Records of means over the steps.
    fn means(&self) -> Spectrum {
        Spectrum::of(|frequency_hz| self.sampled(frequency_hz, |hz| MEANS.power(hz)))
    }
}

/// Amplitudes of the lines of records sixteen times as long as those that are drawn.
struct Spectrum(Vec<f64>);

impl Spectrum {
    fn of(density: impl Fn(f64) -> f64) -> Self {
        let step_hz = 1.0 / (16.0 * COUNT as f64 * STEP_S);
        let line = |line: usize| (density(line as f64 * step_hz) * step_hz).sqrt() / 2.0;
        Self((1..8 * COUNT).map(line).collect())
    }

    /// A part of a drawn record, with white noise.
    fn draw(&self, seed: u64, noise: f64) -> Record {
        let mut random = Pcg64::seed_from_u64(seed);
        let mut draw = || -> f64 { StandardNormal.sample(&mut random) };
        let mut lines = vec![Complex64::default(); 16 * COUNT];
        for (amplitude, line) in self.0.iter().zip(1..) {
            lines[line] = Complex64::new(draw(), draw()) * amplitude;
            lines[16 * COUNT - line] = lines[line].conj();
        }
        FftPlanner::new().plan_fft_inverse(lines.len()).process(&mut lines);
        let values: Vec<f64> = lines[..COUNT].iter().map(|line| line.re).collect();
        Record::new(STEP_S, values.into_iter().map(|value| Some(value + noise * draw())))
    }
}

fn share(of: impl ExactSizeIterator<Item = bool>) -> f64 {
    let count = of.len() as f64;
    of.filter(|holds| *holds).count() as f64 / count
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

#[test]
fn variances_are_inside_their_intervals() {
    for (air, noise_mps) in [
        (FIELD, 0.0),
        (FIELD, 0.1),
        (Air { length_m: 100.0, wind_mps: 2.0, ..FIELD }, 0.1),
        (Air { length_m: 25.0, wind_mps: 6.0, ..FIELD }, 0.0),
        (Air { length_m: 25.0, wind_mps: 6.0, ..FIELD }, 0.3),
        (PLAIN, 0.0),
        (PLAIN, 0.1),
        (Air { length_m: 30.0, ..PLAIN }, 0.1),
    ] {
        let truth = air.sd_mps.powi(2);
        let spectrum = air.means();
        let found: Vec<_> = (0..400)
            .map(|seed| {
                let record = spectrum.draw(seed, noise_mps);
                let fastest = noise::of_means(&record).unwrap();
                moments::variance(&record, fastest.too_much(), 0.0).unwrap()
            })
            .collect();
        let inside = share(found.iter().map(|of| of.low <= truth && truth <= of.high));
        let ratios: Vec<f64> = found.iter().map(|of| of.value / truth).collect();
        let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
        let off = median(ratios);
        println!("{air:?} {noise_mps}: inside {inside}, median {off:.3}, mean {mean:.3}");
        assert!((0.91..=0.98).contains(&inside), "{air:?}: {inside}");
        // A skewed quantity's median is below its mean.
        assert!((off - 1.0).abs() < 0.06, "{air:?}: {off}");
        let se = (2.0 * air.time_s() / (400.0 * COUNT as f64 * STEP_S)).sqrt();
        assert!((mean - 1.0).abs() < 0.02 + 2.0 * se, "{air:?}: {mean}");
    }
}

#[test]
fn spectra_are_inside_their_bands() {
    for air in [FIELD, PLAIN] {
        let instrument =
            Instrument { transfer: MEANS, noise: 0.01, highest_hz: 1.0, ..Instrument::default() };
        let mut inside = std::collections::BTreeMap::<u64, Vec<bool>>::new();
        let means = air.means();
        for seed in 0..300 {
            for band in spectrum(&means.draw(seed, 0.1), &instrument) {
                let truth = air.density(band.frequency_hz);
                let key = (band.frequency_hz.log10() * 8.0 + 80.0).floor() as u64;
                inside.entry(key).or_default().push(band.low <= truth && truth <= band.high);
            }
        }
        let lowest_hz =
            inside.keys().next().map(|key| 10f64.powf((*key as f64 - 80.0) / 8.0)).unwrap();
        assert!(lowest_hz < 1.0 / 250.0, "{lowest_hz}");
        for (band, inside) in &inside {
            let held = share(inside.iter().copied());
            println!("{band} {held} of {}", inside.len());
            assert!((0.90..=0.985).contains(&held), "{air:?}, band {band}: {held}");
        }
        let all = share(inside.values().flatten().copied().collect::<Vec<_>>().into_iter());
        println!("{air:?}: {all}");
        assert!((0.93..=0.97).contains(&all), "{air:?}: {all}");
    }
}

#[test]
fn dissipation_is_that_of_the_air() {
    for air in [FIELD, PLAIN] {
        let truth = air.dissipation();
        let instrument =
            Instrument { transfer: MEANS, noise: 0.01, highest_hz: 1.0, ..Instrument::default() };
        let wind = Wind { speed_mps: 3.0, se_mps: 0.1 };
        let largest_hz = 0.5 / air.time_s();
        let mut found = Vec::new();
        let mut structure = Vec::new();
        let means = air.means();
        for seed in 0..200 {
            let record = means.draw(seed, 0.1);
            let bands = spectrum(&record, &instrument);
            if let Ok(of) = from_spectrum(&bands, Component::Across, wind, largest_hz, 0.0) {
                structure.extend(
                    from_structure(&record, 0.01, Component::Across, wind, (&of, 2.0))
                        .map(|of| of / truth),
                );
                found.push(of);
            }
        }
        let inside = share(found.iter().map(|of| of.low <= truth && truth <= of.high));
        let off = median(found.iter().map(|of| of.value / truth).collect());
        let within = share(found.iter().map(|of| (of.value / truth - 1.0).abs() < 0.25));
        let by_structure = median(structure);
        println!(
            "{air:?}: {} of 200, inside {inside}, median {off}, within 25 % {within}, structure {by_structure}",
            found.len()
        );
        assert!(found.len() > 160, "{air:?}: {}", found.len());
        assert!((off - 1.0).abs() < 0.15 && within > 0.8, "{air:?}: {off} {within}");
        assert!(inside > 0.85, "{air:?}: {inside}");
        assert!((by_structure - 1.0).abs() < 0.3, "{air:?}: {by_structure}");
    }
}

#[test]
fn air_without_an_inertial_range_has_no_dissipation() {
    let mut random = Pcg64::seed_from_u64(9);
    let (mut once, mut air) = (0.0, 0.0);
    let values = (0..COUNT).map(|_| {
        let drawn: f64 = StandardNormal.sample(&mut random);
        once = 0.9 * once + drawn;
        air = 0.9 * air + once;
        Some(air)
    });
    let record = Record::new(STEP_S, values.collect::<Vec<_>>());
    let bands = spectrum(&record, &Instrument { highest_hz: 1.5, ..Instrument::default() });
    let wind = Wind { speed_mps: 3.0, se_mps: 0.1 };
    // It falls with -4.
    assert!(from_spectrum(&bands, Component::Across, wind, 0.01, 0.0).is_err());
    let calm = Wind { speed_mps: 0.1, se_mps: 0.1 };
    assert!(from_spectrum(&bands, Component::Across, calm, 0.01, 0.0).is_err());
}

#[test]
fn noise_is_told_from_air() {
    for air in [FIELD, PLAIN] {
        let (instants, means) = (air.at_instants(), air.means());
        for noise_mps in [0.0, 0.1, 0.3] {
            let mean = |of: &dyn Fn(u64) -> f64| (0..100).map(of).sum::<f64>() / 100.0;
            let at = mean(&|seed| noise::white(&instants.draw(seed, noise_mps)).unwrap());
            let of = |seed| noise::of_means(&means.draw(seed, noise_mps)).unwrap();
            let over = mean(&|seed| of(seed).noise);
            let lost = mean(&|seed| of(seed).lost) / air.sd_mps.powi(2);
            println!("{air:?} {noise_mps}: {at} {over} {lost}");
            // What is left is a hundredth of the air's variance.
            assert!((at - noise_mps * noise_mps).abs() < 0.0025, "{noise_mps}: {at}");
            assert!((over - noise_mps * noise_mps).abs() < 0.0025, "{noise_mps}: {over}");
            assert!((0.02..0.05).contains(&lost), "{lost}");
        }
    }
}
