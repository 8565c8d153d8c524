//! Spectra, cospectra and coherence in bands of frequency, with confidence bands.
//!
//! Each stretch without a gap is tapered by Hann's window and transformed whole: its lowest frequencies are wanted, and a
//! band has many of its lines. Bands are even on a logarithmic axis. Lines of a tapered transform are correlated with
//! their neighbours, which the degrees of freedom of a band count (Percival and Walden 1993, section 6.4); so are drones
//! that fly side by side, which [`mean`] counts by their coherence.

use rustfft::FftPlanner;
use rustfft::num_complex::Complex64;

use crate::Record;
use crate::quantile::{of_variance, scaled};
use crate::transfer::Transfer;

/// Bands in a decade of frequency.
const PER_DECADE: f64 = 8.0;
/// Shortest stretch that is transformed, values.
const SHORTEST: usize = 32;
/// The lowest line that a taper leaves clear of the mean.
const LOWEST_LINE: usize = 2;
/// Correlation of the powers of lines next to each other, and of lines two apart, under Hann's window: `(2/3)²` and
/// `(1/6)²`.
const CORRELATION: [f64; 2] = [4.0 / 9.0, 1.0 / 36.0];
/// Bands are told up to the frequency at which the instrument still measures this share of the variance.
pub const SHARE: f64 = 0.5;

/// Response, noise and scale of an instrument.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Instrument {
    /// Response, which spectra are divided by.
    pub transfer: Transfer,
    /// Variance of the white noise of one value, which is taken off.
    pub noise: f64,
    /// Relative standard error of the scale of values.
    pub scale_se: f64,
    /// Relative standard error of the response's power, in each band for itself.
    pub response_se: f64,
    /// Highest frequency that is told, Hz; 0: a quarter of the sampling frequency.
    pub highest_hz: f64,
}

impl Instrument {
    /// Degrees of freedom of a density, so many by its sampling alone, with the error of the response: that of a mean over n
    /// degrees of freedom is `sqrt(2/n)`.
    fn freedom(&self, sampled: f64) -> f64 {
        1.0 / (1.0 / sampled + 0.5 * self.response_se.powi(2))
    }
}

/// Spectral density in a band of frequencies.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Band {
    /// Mean frequency of the band's lines, Hz.
    pub frequency_hz: f64,
    /// One-sided density, (m/s)²/Hz.
    pub density: f64,
    /// Ends of the 95 % interval.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Degrees of freedom.
    pub freedom: f64,
}

/// Cospectrum and coherence of two records in a band.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct CrossBand {
    /// Mean frequency of the band's lines, Hz.
    pub frequency_hz: f64,
    /// One-sided cospectrum, (m/s)²/Hz: its integral is the covariance.
    pub co: f64,
    /// Standard error of the cospectrum.
    pub co_se: f64,
    /// One-sided quadrature spectrum, (m/s)²/Hz; positive: the first record leads.
    pub quad: f64,
    /// Squared coherence, corrected for its bias; 0 where nothing is left.
    pub coherence: f64,
    /// Squared coherence above which it is told from none at 95 %.
    pub coherence_threshold: f64,
    /// Degrees of freedom.
    pub freedom: f64,
}

/// Lines of one stretch: transforms of all records over it.
struct Lines {
    /// Distance of lines, Hz.
    step_hz: f64,
    /// For each record, scaled so that the squared modulus is a one-sided density.
    of: Vec<Vec<Complex64>>,
}

/// Transforms of records over the stretches in which all are known.
fn lines(records: &[&Record]) -> Vec<Lines> {
    let Some(first) = records.first() else { return Vec::new() };
    let same = |record: &&Record| (record.step_s() - first.step_s()).abs() <= 1e-9 * first.step_s();
    if !records.iter().all(same) {
        return Vec::new();
    }
    let length = records.iter().map(|record| record.len()).min().unwrap_or(0);
    let known = |at: usize| records.iter().all(|record| !record.values()[at].is_nan());
    let mut planner = FftPlanner::new();
    let mut found = Vec::new();
    let mut from = 0;
    for at in 0..=length {
        if at < length && known(at) {
            continue;
        }
        if at - from >= SHORTEST {
            let of = records.iter().map(|record| {
                transformed(&record.values()[from..at], record.step_s(), &mut planner)
            });
            let step_hz = 1.0 / ((at - from) as f64 * first.step_s());
            found.push(Lines { step_hz, of: of.collect() });
        }
        from = at + 1;
    }
    found
}

fn transformed(values: &[f64], step_s: f64, planner: &mut FftPlanner<f64>) -> Vec<Complex64> {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let taper = |k: usize| 0.5 - 0.5 * (std::f64::consts::TAU * (k as f64 + 0.5) / count).cos();
    let mut lines: Vec<Complex64> = values
        .iter()
        .enumerate()
        .map(|(k, value)| Complex64::new((value - mean) * taper(k), 0.0))
        .collect();
    planner.plan_fft_forward(lines.len()).process(&mut lines);
    lines.truncate(values.len() / 2);
    // The window's mean square is 3/8; twice: the spectrum has one side.
    let scale = (2.0 * step_s / (0.375 * count)).sqrt();
    for line in &mut lines {
        *line *= scale;
    }
    lines
}

/// Degrees of freedom of the mean over so many lines next to each other.
fn freedom(lines: usize) -> f64 {
    let count = lines as f64;
    let with_next = CORRELATION
        .iter()
        .zip(1..)
        .map(|(correlation, apart)| 2.0 * correlation * (1.0 - f64::from(apart) / count).max(0.0));
    2.0 * count / (1.0 + with_next.sum::<f64>())
}

/// Number of a frequency's band.
fn band_of(frequency_hz: f64) -> i64 {
    (frequency_hz.log10() * PER_DECADE).floor() as i64
}

/// Sums over the lines of a band.
#[derive(Clone, Default)]
struct Sum {
    lines: f64,
    freedom: f64,
    frequency: f64,
    /// Products of all pairs of records, first by first.
    products: Vec<Complex64>,
}

/// Sums by band, of all stretches, over the records' products.
fn sums(records: &[&Record], instrument: &Instrument) -> Vec<Sum> {
    let stretches = lines(records);
    let Some(first) = records.first() else { return Vec::new() };
    let nyquist_hz = 0.5 / first.step_s();
    let wanted = if instrument.highest_hz > 0.0 { instrument.highest_hz } else { 0.5 * nyquist_hz };
    let limit_hz = instrument.transfer.limit_hz(SHARE, wanted.min(nyquist_hz));
    let mut bands = std::collections::BTreeMap::<i64, Sum>::new();
    for stretch in &stretches {
        let mut counts = std::collections::BTreeMap::<i64, usize>::new();
        let count = stretch.of.first().map_or(0, Vec::len);
        for line in LOWEST_LINE..count {
            let frequency_hz = line as f64 * stretch.step_hz;
            if frequency_hz > limit_hz {
                break;
            }
            let band = band_of(frequency_hz);
            *counts.entry(band).or_default() += 1;
            let sum = bands.entry(band).or_default();
            sum.lines += 1.0;
            sum.frequency += frequency_hz;
            sum.products.resize(records.len() * records.len(), Complex64::default());
            let power = instrument.transfer.power(frequency_hz);
            for (i, one) in stretch.of.iter().enumerate() {
                for (j, other) in stretch.of.iter().enumerate().skip(i) {
                    let product = one[line].conj() * other[line] / power;
                    sum.products[i * records.len() + j] += product;
                }
            }
        }
        for (band, count) in counts {
            if let Some(sum) = bands.get_mut(&band) {
                sum.freedom += freedom(count);
            }
        }
    }
    bands.into_values().collect()
}

/// Density of the noise of one value after the response was divided out.
fn noise_density(record: &Record, instrument: &Instrument, frequency_hz: f64) -> f64 {
    2.0 * instrument.noise * record.step_s() / instrument.transfer.power(frequency_hz)
}

/// Band from its density with noise, of so many degrees of freedom.
fn band(frequency_hz: f64, with_noise: f64, noise: f64, freedom: f64, scale_se: f64) -> Band {
    let density = (with_noise - noise).max(0.0);
    // Noise scatters, too; what it is on average is taken off.
    let [low, high] = of_variance(with_noise, freedom).map(|end| (end - noise).max(0.0));
    let [low, high] = scaled(density, [low, high], 2.0 * scale_se);
    Band { frequency_hz, density, low, high, freedom }
}

/// Spectrum of one record; empty where it is too short.
pub fn spectrum(record: &Record, instrument: &Instrument) -> Vec<Band> {
    mean(&[record], instrument)
}

/// Bands with fewer degrees of freedom than this say nothing of coherence by themselves: with one line, everything is
/// coherent.
const COHERENT_FROM: f64 = 10.0;

/// Mean spectrum of several records of the same air, as of drones that fly side by side: their densities are not
/// independent, and the fewer degrees of freedom they have together, the more coherent they are. The lowest bands, of few
/// lines, have the coherence of all of them together.
pub fn mean(records: &[&Record], instrument: &Instrument) -> Vec<Band> {
    let count = records.len();
    let Some(first) = records.first() else { return Vec::new() };
    let sums = sums(records, instrument);
    // Stretches between gaps may all be too short.
    if sums.is_empty() {
        return Vec::new();
    }
    let density = |sum: &Sum| {
        let own = |i: usize| sum.products[i * count + i].re / sum.lines;
        (0..count).map(own).sum::<f64>() / count as f64
    };
    let mut lowest = Sum::default();
    for sum in &sums {
        lowest.add_whitened(sum, density(sum));
        if lowest.freedom >= COHERENT_FROM {
            break;
        }
    }
    let of_lowest = independent(&lowest, count);
    let one = |sum: &Sum| {
        let known = sum.freedom >= COHERENT_FROM;
        let independent = if known { independent(sum, count) } else { of_lowest };
        let frequency_hz = sum.frequency / sum.lines;
        let noise = noise_density(first, instrument, frequency_hz);
        let freedom = instrument.freedom(sum.freedom * independent);
        band(frequency_hz, density(sum), noise, freedom, instrument.scale_se)
    };
    sums.iter().map(one).collect()
}

impl Sum {
    /// Adds another band's products, as if its density were 1.
    fn add_whitened(&mut self, band: &Self, density: f64) {
        self.products.resize(band.products.len(), Complex64::default());
        for (sum, product) in self.products.iter_mut().zip(&band.products) {
            *sum += product / density;
        }
        self.lines += band.lines;
        self.freedom += band.freedom;
    }
}

/// As how many independent records the mean density of these is known: 1 where all are coherent.
fn independent(sum: &Sum, count: usize) -> f64 {
    let of = |i: usize, j: usize| sum.products[i * count + j];
    let mut all = 0.0;
    for i in 0..count {
        for j in i + 1..count {
            // Records that have nothing in common still seem to, by 2/freedom.
            let product = of(i, i).re * of(j, j).re;
            let bias = (2.0 / sum.freedom).min(1.0);
            let shared = (of(i, j).norm_sqr() - bias * product) / (1.0 - bias).max(0.1);
            all += 2.0 * shared.clamp(0.0, product);
        }
        all += of(i, i).re.powi(2);
    }
    let mean = (0..count).map(|i| of(i, i).re).sum::<f64>();
    if all > 0.0 { mean.powi(2) / all } else { 1.0 }
}

/// Cospectrum and coherence of two records.
///
/// Variances of the estimates: Bendat and Piersol 2010, table 9.6; bias and threshold of the coherence of `n` degrees of
/// freedom: `2/n` and `1 - 0.05^(2/(n - 2))`.
pub fn cross(a: &Record, b: &Record, instrument: &Instrument) -> Vec<CrossBand> {
    let one = |sum: Sum| {
        let of = |at: usize| sum.products[at] / sum.lines;
        let (of_a, of_b, of_both) = (of(0).re, of(3).re, of(1));
        let freedom = sum.freedom;
        let product = of_a * of_b;
        let co_se = ((product + of_both.re.powi(2) - of_both.im.powi(2)).max(0.0) / freedom).sqrt();
        let raw = if product > 0.0 { of_both.norm_sqr() / product } else { 0.0 };
        let bias = (2.0 / freedom).min(1.0);
        let coherence = if bias < 1.0 { ((raw - bias) / (1.0 - bias)).max(0.0) } else { 0.0 };
        let threshold = 1.0 - 0.05f64.powf(2.0 / (freedom - 2.0).max(0.1));
        CrossBand {
            frequency_hz: sum.frequency / sum.lines,
            co: of_both.re,
            co_se: co_se.hypot(of_both.re * instrument.scale_se),
            quad: -of_both.im,
            coherence,
            coherence_threshold: ((threshold - bias) / (1.0 - bias)).max(0.0),
            freedom,
        }
    };
    sums(&[a, b], instrument).into_iter().map(one).collect()
}

/// Standard error of the slope of the logarithm of densities over that of frequency, and the slope; `None` of fewer than
/// three bands.
pub fn slope(bands: &[Band]) -> Option<(f64, f64)> {
    let known: Vec<(f64, f64, f64)> = bands
        .iter()
        .filter(|band| band.density > 0.0 && band.freedom > 2.0)
        // The logarithm of a mean over n degrees of freedom scatters by sqrt(2/n), and is 1/n low.
        .map(|band| {
            let weight = 0.5 * band.freedom;
            (band.frequency_hz.ln(), band.density.ln() + 1.0 / band.freedom, weight)
        })
        .collect();
    if known.len() < 3 {
        return None;
    }
    let all: f64 = known.iter().map(|(.., weight)| weight).sum();
    let x = known.iter().map(|(x, _, weight)| x * weight).sum::<f64>() / all;
    let y = known.iter().map(|(_, y, weight)| y * weight).sum::<f64>() / all;
    let square: f64 = known.iter().map(|(at, _, weight)| weight * (at - x).powi(2)).sum();
    let both: f64 = known.iter().map(|(at, of, weight)| weight * (at - x) * (of - y)).sum();
    (square > 0.0).then(|| (both / square, square.recip().sqrt()))
}
