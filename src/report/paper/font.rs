//! The font of figures for print: Noto Sans with the letters, Greek and signs of mathematics that figures use.
//!
//! `templates/report/vendor/NotoSans/` has it for PDF (TrueType) and for SVG (WOFF2): Noto Sans 2.004, and from Noto Sans
//! Math 2.001 the signs that it lacks; the minus is the bar of its plus. Its licence is the SIL Open Font License.

use std::sync::{Arc, LazyLock};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use svg2pdf::usvg::fontdb::Database;
use ttf_parser::Face;

pub(super) const REGULAR: &[u8] =
    include_bytes!("../../../templates/report/vendor/NotoSans/Regular.ttf");
pub(super) const BOLD: &[u8] = include_bytes!("../../../templates/report/vendor/NotoSans/Bold.ttf");
const REGULAR_WEB: &[u8] =
    include_bytes!("../../../templates/report/vendor/NotoSans/Regular.woff2");
const BOLD_WEB: &[u8] = include_bytes!("../../../templates/report/vendor/NotoSans/Bold.woff2");

/// Name of the family.
pub(super) const FAMILY: &str = "Noto Sans";

/// Both weights, and nothing of the machine's.
static FONTS: LazyLock<Arc<Database>> = LazyLock::new(|| {
    let mut fonts = Database::new();
    fonts.load_font_data(REGULAR.to_vec());
    fonts.load_font_data(BOLD.to_vec());
    fonts.set_sans_serif_family(FAMILY);
    Arc::new(fonts)
});

/// All fonts that there are for figures.
pub(super) fn fonts() -> Arc<Database> {
    Arc::clone(&FONTS)
}

/// Whether the font has a character.
pub(super) fn has(character: char) -> bool {
    static FACE: LazyLock<Option<Face<'static>>> = LazyLock::new(|| Face::parse(REGULAR, 0).ok());
    FACE.as_ref().is_some_and(|face| face.glyph_index(character).is_some())
}

/// A drawing with the weights of the font that it uses.
pub(super) fn embedded(svg: &str) -> String {
    let mut style = face(400, REGULAR_WEB);
    if svg.contains("font-weight=\"bold\"") {
        style.push_str(&face(700, BOLD_WEB));
    }
    let head = svg.find('>').map_or(0, |end| end + 1);
    let (head, body) = svg.split_at(head);
    format!("{head}<style>{style}</style>{body}")
}

fn face(weight: u16, font: &[u8]) -> String {
    format!(
        "@font-face{{font-family:'{FAMILY}';font-weight:{weight};src:url(data:font/woff2;base64,{}) \
         format('woff2')}}",
        STANDARD.encode(font)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::digest::sha256;

    const LICENCE: &str = include_str!("../../../templates/report/vendor/NotoSans/OFL.txt");

    /// Of the files as they were made.
    const MADE: [(&[u8], &str); 4] = [
        (REGULAR, "18b785b27f2d89515b30a7aea949012c8fe33053ee4bf1fc84463c11b6df398d"),
        (BOLD, "62a088a3a4bb6b76f8d8414b920e54971ac1f8b066fb670080909fe3356a381b"),
        (REGULAR_WEB, "6f1f9a960860d897663e5577eb424208c3cb8ecb9d55eed3732ec1019b1f8f8e"),
        (BOLD_WEB, "2c0bf1d8c4caa888c5d9b062f54b01324acf439cb2689906d4fcc5fc25525aa0"),
    ];

    #[test]
    fn the_fonts_are_those_that_were_made_and_have_their_licence() {
        for (font, expected) in MADE {
            assert_eq!(sha256(font), expected);
        }
        assert!(LICENCE.contains("SIL OPEN FONT LICENSE Version 1.1"));
        assert!(LICENCE.contains("Google"), "whose font it is");
    }

    #[test]
    fn both_weights_have_every_character_of_the_figures() {
        let used = "0Az~ ±²³¹·×°µ÷é…–—′″‘’“”•−√∞≈≠≤≥←→↑↓∂∇∑₀₁₂⁰⁴⁸⁻αβγδεζηθκλμνξπρστφχψωΓΔΘΛΣΦΨΩőşŽ\u{fffd}";
        for font in [REGULAR, BOLD] {
            let face = Face::parse(font, 0).unwrap();
            let lacking: String = used.chars().filter(|c| face.glyph_index(*c).is_none()).collect();
            assert_eq!(lacking, "");
        }
        assert!(!has('山'));
    }

    #[test]
    fn only_the_weights_that_are_used_are_embedded() {
        let plain = embedded("<svg><text>a</text></svg>");
        assert!(plain.starts_with("<svg><style>@font-face") && plain.contains("font-weight:400"));
        assert!(!plain.contains("font-weight:700"));
        assert!(
            embedded("<svg><text font-weight=\"bold\">a</text></svg>").contains("font-weight:700")
        );
    }
}
