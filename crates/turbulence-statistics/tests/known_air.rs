//! Statistics of drawn air whose spectrum is known: von Karman's, carried past at a constant wind.
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
use turbulence_statistics::{Record, moments, noise};

const STEP_S: f64 = 0.25;
/// Ten minutes.
const COUNT: usize = 2400;

/// Air across the wind.
#[derive(Clone, Copy)]
struct Air {
    sd_mps: f64,
    length_m: f64,
    wind_mps: f64,
}

const FIELD: Air = Air { sd_mps: 0.5, length_m: 50.0, wind_mps: 3.0 };

impl Air {
    /// One-sided spectral density, (m/s)²/Hz.
    fn density(&self, frequency_hz: f64) -> f64 {
        let n = 1.339 * std::f64::consts::TAU * frequency_hz * self.length_m / self.wind_mps;
        2.0 * self.sd_mps.powi(2) * self.length_m / self.wind_mps * (1.0 + 8.0 / 3.0 * n * n)
            / (1.0 + n * n).powf(11.0 / 6.0)
    }

    /// Rate of dissipation that its spectrum has at high frequencies.
    fn dissipation(&self) -> f64 {
        let f = 1e3;
        let level = self.density(f) * f.powf(5.0 / 3.0);
        let constant = ACROSS * C1 * (self.wind_mps / std::f64::consts::TAU).powf(2.0 / 3.0);
        (level / constant).powf(1.5)
    }

    /// Density of a sampled record: what is faster than it can show is folded back.
    fn sampled(&self, frequency_hz: f64) -> f64 {
        let rate_hz = 1.0 / STEP_S;
        let folded = (1..40).map(|k| {
            let around = f64::from(k) * rate_hz;
            self.density(around - frequency_hz) + self.density(around + frequency_hz)
        });
        self.density(frequency_hz) + folded.sum::<f64>()
    }

    /// Records of it at instants.
    fn at_instants(&self) -> Spectrum {
        Spectrum::of(|frequency_hz| self.sampled(frequency_hz))
    }

    /// Records of an instrument that passes only what its sampling can show.
    fn limited(&self) -> Spectrum {
        Spectrum::of(|frequency_hz| self.density(frequency_hz))
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
        (FIELD, 0.1),
        (Air { length_m: 100.0, wind_mps: 2.0, ..FIELD }, 0.1),
        (Air { length_m: 25.0, wind_mps: 6.0, ..FIELD }, 0.3),
    ] {
        let truth = air.sd_mps.powi(2);
        let spectrum = air.at_instants();
        let found: Vec<_> = (0..400)
            .map(|seed| {
                let record = spectrum.draw(seed, noise_mps);
                let noise = noise::white(&record).unwrap();
                moments::variance(&record, noise, 0.0).unwrap()
            })
            .collect();
        let inside = share(found.iter().map(|of| of.low <= truth && truth <= of.high));
        let off = median(found.iter().map(|of| of.value / truth).collect());
        println!("{} m: inside {inside}, median {off}", air.length_m);
        assert!((0.91..=0.98).contains(&inside), "{}: {inside}", air.length_m);
        assert!((off - 1.0).abs() < 0.06, "{}: {off}", air.length_m);
    }
}

#[test]
fn spectra_are_inside_their_bands() {
    let instrument = Instrument { noise: 0.01, highest_hz: 1.0, ..Instrument::default() };
    let mut inside = std::collections::BTreeMap::<u64, Vec<bool>>::new();
    let limited = FIELD.limited();
    for seed in 0..300 {
        for band in spectrum(&limited.draw(seed, 0.1), &instrument) {
            let truth = FIELD.density(band.frequency_hz);
            let key = (band.frequency_hz.log10() * 8.0 + 80.0).floor() as u64;
            inside.entry(key).or_default().push(band.low <= truth && truth <= band.high);
        }
    }
    let lowest_hz = inside.keys().next().map(|key| 10f64.powf((*key as f64 - 80.0) / 8.0)).unwrap();
    assert!(lowest_hz < 1.0 / 250.0, "{lowest_hz}");
    for (band, inside) in &inside {
        let held = share(inside.iter().copied());
        println!("{band} {held} of {}", inside.len());
        assert!((0.90..=0.985).contains(&held), "band {band}: {held}");
    }
    let all = share(inside.values().flatten().copied().collect::<Vec<_>>().into_iter());
    assert!((0.93..=0.97).contains(&all), "{all}");
}

#[test]
fn dissipation_is_that_of_the_air() {
    let truth = FIELD.dissipation();
    let instrument = Instrument { noise: 0.01, highest_hz: 1.0, ..Instrument::default() };
    let wind = Wind { speed_mps: 3.0, se_mps: 0.1 };
    let mut found = Vec::new();
    let mut structure = Vec::new();
    let limited = FIELD.limited();
    for seed in 0..200 {
        let record = limited.draw(seed, 0.1);
        let bands = spectrum(&record, &instrument);
        if let Ok(of) = from_spectrum(&bands, Component::Across, wind, 3.0 / 50.0, 0.0) {
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
        "{} of 200, inside {inside}, median {off}, within 25 % {within}, structure {by_structure}",
        found.len()
    );
    assert!(found.len() > 160, "{}", found.len());
    assert!((off - 1.0).abs() < 0.15 && within > 0.8 && inside > 0.85, "{off} {within} {inside}");
    assert!((by_structure - 1.0).abs() < 0.3, "{by_structure}");
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
    let spectrum = FIELD.at_instants();
    for noise_mps in [0.0, 0.1, 0.3] {
        let found = (0..100).map(|seed| noise::white(&spectrum.draw(seed, noise_mps)).unwrap());
        let mean = found.sum::<f64>() / 100.0;
        println!("{noise_mps}: {mean}");
        // What is left is a hundredth of the air's variance.
        assert!((mean - noise_mps * noise_mps).abs() < 0.0025, "{noise_mps}: {mean}");
    }
}
