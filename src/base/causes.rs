//! Errors together with their causes in one text.

use std::error::Error;

/// Text of an error and its causes, each said once, joined by `between`.
///
/// ```
/// use updraft::base::causes::with_causes;
/// use updraft::base::file::FileError;
///
/// let full = FileError::new("write", "a.bin".as_ref(), std::io::Error::other("disk full"));
/// assert_eq!(with_causes(&full, ": "), "failed to write a.bin: disk full");
/// ```
pub fn with_causes(error: &dyn Error, between: &str) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(cause) = source {
        let line = cause.to_string();
        // Transparent wrappers repeat their source.
        if !text.contains(&line) {
            text.push_str(between);
            text.push_str(&line);
        }
        source = cause.source();
    }
    text
}
