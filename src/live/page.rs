//! The page itself: one file, without a request to anywhere else.

const PAGE: &str = include_str!("../../templates/live/page.html");
const STYLE: &str = include_str!("../../templates/live/page.css");
const SCRIPTS: [&str; 6] = [
    include_str!("../../templates/live/words.js"),
    include_str!("../../templates/live/board.js"),
    include_str!("../../templates/live/map.js"),
    include_str!("../../templates/live/orders.js"),
    include_str!("../../templates/live/replay.js"),
    include_str!("../../templates/live/stream.js"),
];

/// Picture in the browser's tab.
pub const ICON: &str = include_str!("../../templates/live/icon.svg");

/// The page, whose script and style carry this nonce.
pub fn html(nonce: &str) -> String {
    PAGE.replace("{{nonce}}", nonce)
        .replace("{{style}}", STYLE)
        .replace("{{script}}", &SCRIPTS.concat())
}
