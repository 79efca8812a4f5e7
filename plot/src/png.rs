//! Figures as pixels.

use resvg::{tiny_skia, usvg};
use snaprod_core::error::{Error, Result};
use std::sync::Arc;

/// DejaVu Sans, the part of it that figures use (see `assets/README.md`).
const FONT: &[u8] = include_bytes!("../assets/DejaVuSans-subset.ttf");
/// No picture is wider or higher than this.
const LARGEST: f32 = 16_384.0;

/// Turns an SVG figure of this module into PNG, `scale` pixels to each of its own (2 gives about 200 dots
/// per inch at the intended size), lettered in the bundled font.
///
/// Errs if `svg` is not SVG, or if the picture would be empty or more than 16384 pixels wide or high.
pub fn png(svg: &str, scale: f32) -> Result<Vec<u8>> {
    let mut fonts = usvg::fontdb::Database::new();
    fonts.load_font_data(FONT.to_vec());
    fonts.set_sans_serif_family("DejaVu Sans");
    let options = usvg::Options {
        font_family: "DejaVu Sans".into(),
        fontdb: Arc::new(fonts),
        ..usvg::Options::default()
    };
    let tree = usvg::Tree::from_str(svg, &options)
        .map_err(|e| Error::domain(format!("PNG: not a drawing: {e}")))?;
    let (width, height) = (tree.size().width() * scale, tree.size().height() * scale);
    let fits = |side: f32| (1.0..=LARGEST).contains(&side.round());
    if !(fits(width) && fits(height)) {
        return Err(Error::domain(format!(
            "PNG: a picture of {width} x {height} pixels"
        )));
    }
    tiny_skia::Pixmap::new(width.round() as u32, height.round() as u32)
        .and_then(|mut pixels| {
            let enlarge = tiny_skia::Transform::from_scale(scale, scale);
            resvg::render(&tree, enlarge, &mut pixels.as_mut());
            pixels.encode_png().ok()
        })
        .ok_or_else(|| Error::domain("PNG: the picture could not be encoded"))
}
