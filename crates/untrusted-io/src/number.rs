//! Numbers in sentences: never hundreds of digits, whatever a file or an option contains.

/// Sizes from which a number is written with an exponent.
const LARGE: f64 = 1e12;
/// Sizes below which a number other than zero is written with an exponent.
const SMALL: f64 = 1e-9;

/// A number as short as it can be written: `7`, `0.25`, `1e300`.
///
/// ```
/// use untrusted_io::number::plain;
///
/// assert_eq!(plain(7.0), "7");
/// assert_eq!(plain(1e300), "1e300");
/// ```
pub fn plain(value: f64) -> String {
    let size = value.abs();
    if size.is_finite() && size != 0.0 && !(SMALL..LARGE).contains(&size) {
        format!("{value:e}")
    } else {
        value.to_string()
    }
}

/// A number with a fixed count of decimals, or with an exponent if it is so large that decimals
/// mean nothing.
///
/// ```
/// use untrusted_io::number::fixed;
///
/// assert_eq!(fixed(7.0, 3), "7.000");
/// assert_eq!(fixed(1.25e300, 3), "1.250e300");
/// ```
pub fn fixed(value: f64, decimals: usize) -> String {
    if value.is_finite() && value.abs() >= LARGE {
        format!("{value:.decimals$e}")
    } else {
        format!("{value:.decimals$}")
    }
}

/// A number with two decimals at most, and three digits at least where it has them: `7.25`, `781.7`,
/// `7817`.
///
/// ```
/// use untrusted_io::number::brief;
///
/// assert_eq!([7.25, 781.72, 7817.4].map(brief), ["7.25", "781.7", "7817"]);
/// ```
pub fn brief(value: f64) -> String {
    let decimals = match value.abs() {
        size if size < 100.0 => 2,
        size if size < 1000.0 => 1,
        _ => 0,
    };
    fixed(value, decimals)
}
