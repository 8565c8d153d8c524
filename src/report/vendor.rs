//! Libraries of others that a page carries, as they were published: `templates/report/vendor/`.

/// uPlot 1.6.32, as `dist/` of its npm package has it.
const UPLOT: &str = include_str!("../../templates/report/vendor/uPlot.iife.min.js");
const UPLOT_STYLE: &str = include_str!("../../templates/report/vendor/uPlot.min.css");
const UPLOT_LICENSE: &str = include_str!("../../templates/report/vendor/uPlot.LICENSE");

/// The plotting library with its licence.
pub(super) fn plotter() -> String {
    // Its first line is a comment with its address: pages name no addresses.
    let code = UPLOT.split_once("*/").map_or(UPLOT, |(_, code)| code);
    format!("/*! uPlot 1.6.32\n\n{}\n*/{code}", UPLOT_LICENSE.trim())
}

/// The look of its plots.
pub(super) fn plotter_style() -> &'static str {
    UPLOT_STYLE
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::digest::sha256;

    /// Of the files in `uplot-1.6.32.tgz` of the npm registry.
    const PUBLISHED: [(&str, &str); 3] = [
        (UPLOT, "19c8d4c6ad88929a79f4ae49d6f7161566dfd0ba3d15cc495e974f787eb78f1f"),
        (UPLOT_STYLE, "df630c6a8d6f8eeaff264b50f73ce5b114f646ffd9a0bb74f049b0a00135fa04"),
        (UPLOT_LICENSE, "8f989229699b4fe2f1a0432d0e9edc338a8a911e250e2d1b01ecd770a5f5b1bd"),
    ];

    #[test]
    fn the_library_is_as_it_was_published() {
        for (content, expected) in PUBLISHED {
            assert_eq!(sha256(content.as_bytes()), expected, "{content:.60}");
        }
    }

    #[test]
    fn its_licence_goes_with_it_and_nothing_of_it_ends_the_script() {
        let script = plotter();
        assert!(script.contains("Copyright (c) 2022 Leon Sorokin"));
        assert!(script.contains("var uPlot=function"));
        assert!(!script.contains("</script") && !script.contains("<!--"));
    }
}
