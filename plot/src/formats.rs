//! Figures in formats other than SVG.

use snaprod_core::error::{Error, Result};
use std::sync::Arc;

/// The subset of DejaVu Sans that figures use (see `assets/README.md`).
const FONT: &[u8] = include_bytes!("../assets/DejaVuSans-subset.ttf");
/// Largest width and height of a picture, in pixels.
#[cfg(feature = "png")]
const LARGEST: f32 = 16_384.0;
/// Pixels of SVG in an inch.
#[cfg(feature = "pdf")]
const PIXELS: f32 = 96.0;

/// The drawing, lettered in the bundled font.
fn drawing(svg: &str) -> Result<usvg::Tree> {
    let mut fonts = usvg::fontdb::Database::new();
    fonts.load_font_data(FONT.to_vec());
    fonts.set_sans_serif_family("DejaVu Sans");
    let options = usvg::Options {
        font_family: "DejaVu Sans".into(),
        fontdb: Arc::new(fonts),
        ..usvg::Options::default()
    };
    usvg::Tree::from_str(svg, &options)
        .map_err(|e| Error::domain(format!("a figure that is no drawing: {e}")))
}

/// Turns an SVG figure of this crate into PNG, lettered in the bundled font. Each pixel of the figure becomes
/// `scale` pixels; 2 gives about 200 dots per inch at the intended size.
///
/// Fails if `svg` is not SVG, or if the picture would be empty or more than 16384 pixels wide or high.
#[cfg(feature = "png")]
pub fn png(svg: &str, scale: f32) -> Result<Vec<u8>> {
    pixels(&drawing(svg)?, scale)?
        .encode_png()
        .map_err(|e| Error::domain(format!("PNG: the picture could not be encoded: {e}")))
}

/// The drawing in pixels.
#[cfg(feature = "png")]
fn pixels(tree: &usvg::Tree, scale: f32) -> Result<resvg::tiny_skia::Pixmap> {
    use resvg::tiny_skia;
    let (width, height) = (tree.size().width() * scale, tree.size().height() * scale);
    let fits = |side: f32| (1.0..=LARGEST).contains(&side.round());
    if !(fits(width) && fits(height)) {
        return Err(Error::domain(format!(
            "PNG: a picture of {width} x {height} pixels"
        )));
    }
    let mut pixels = tiny_skia::Pixmap::new(width.round() as u32, height.round() as u32)
        .ok_or_else(|| Error::domain("PNG: the picture has no room in memory"))?;
    let enlarge = tiny_skia::Transform::from_scale(scale, scale);
    resvg::render(tree, enlarge, &mut pixels.as_mut());
    Ok(pixels)
}

/// Turns frames of one size into an animated GIF that runs over and over; each frame is shown for its seconds, to a
/// hundredth. Each pixel of a frame becomes `scale` pixels. A frame has at most 256 colours, its most frequent ones.
///
/// Fails if a frame is not SVG, if there is none, or if a side is more than 16384 pixels.
#[cfg(feature = "png")]
pub fn gif(frames: &[String], seconds: &[f64], scale: f32) -> Result<Vec<u8>> {
    let broken = |e: gif::EncodingError| Error::domain(format!("GIF: {e}"));
    let draw = |svg: &String| pixels(&drawing(svg)?, scale);
    let first = frames.first().map(draw).transpose()?;
    let first = first.ok_or_else(|| Error::domain("GIF: a film without frames"))?;
    let (width, height) = (first.width() as u16, first.height() as u16);
    let mut bytes = Vec::new();
    // The end of the file is written when the encoder goes.
    {
        let mut encoder = gif::Encoder::new(&mut bytes, width, height, &[]).map_err(broken)?;
        encoder.set_repeat(gif::Repeat::Infinite).map_err(broken)?;
        for (svg, seconds) in frames.iter().zip(seconds) {
            let mut pixels = draw(svg)?;
            if (pixels.width(), pixels.height()) != (first.width(), first.height()) {
                return Err(Error::domain("GIF: frames of several sizes"));
            }
            let mut frame = gif::Frame::from_rgba_speed(width, height, pixels.data_mut(), 20);
            frame.delay = (seconds * 100.0).round().clamp(2.0, 6e4) as u16;
            encoder.write_frame(&frame).map_err(broken)?;
        }
    }
    Ok(bytes)
}

/// Turns an SVG figure of this crate into PDF. The page has the size of the figure, with lines as lines and letters
/// as letters of the bundled font, which is embedded. A figure for a screen has 96 of its pixels in an inch.
///
/// Fails if `svg` is not SVG.
#[cfg(feature = "pdf")]
pub fn pdf(svg: &str) -> Result<Vec<u8>> {
    let page = svg2pdf::PageOptions { dpi: PIXELS };
    svg2pdf::to_pdf(&drawing(svg)?, svg2pdf::ConversionOptions::default(), page)
        .map_err(|e| Error::domain(format!("PDF: {e}")))
}

#[cfg(all(test, feature = "png", feature = "pdf"))]
mod tests {
    use super::*;
    use crate::{LineStyle, Lines, Paper, Series, lines};

    fn figure(paper: &Paper, [x, y, name]: [&str; 3]) -> String {
        let series = Series {
            name: name.into(),
            x: vec![0.0, 1.0, 2.0],
            y: vec![1.0, 3.0, 2.0],
            trace: LineStyle::Line,
            colour: None,
        };
        let data = Lines {
            x_label: x.into(),
            y_label: y.into(),
            series: vec![series],
            ..Lines::default()
        };
        lines(&data, paper).unwrap()
    }

    const WORDS: [&str; 3] = ["time t (√(μℓ³/EI))", "energy (EI/ℓ)", "kinetic"];

    /// Catches pictures of another size, and pictures without letters.
    #[test]
    fn a_png_has_the_size_asked_for() {
        let svg = figure(&Paper::SCREEN, WORDS);
        let size = drawing(&svg).unwrap().size();
        for scale in [1.0, 2.5] {
            let bytes = png(&svg, scale).unwrap();
            assert_eq!(&bytes[1..4], b"PNG");
            let word = |i: usize| u32::from_be_bytes(bytes[i..i + 4].try_into().unwrap());
            assert_eq!(word(16), (scale * size.width()).round() as u32);
            assert_eq!(word(20), (scale * size.height()).round() as u32);
        }
        let mute = figure(&Paper::SCREEN, [""; 3]);
        let [said, mute] = [&svg, &mute].map(|svg| png(svg, 2.0).unwrap().len());
        assert!(said > mute + 3000, "{said} and {mute} bytes");
        for (svg, scale) in [
            ("no drawing", 1.0),
            (&svg, 0.0),
            (&svg, f32::NAN),
            (&svg, 1e9),
            (&svg, -1.0),
        ] {
            assert!(png(svg, scale).is_err_and(|e| e.is_domain()));
        }
    }

    /// Catches films without some frames, times or colours.
    #[test]
    fn a_gif_shows_each_frame_for_its_time() {
        let frames = [["a", "y", "z"], ["b", "y", "z"]].map(|words| figure(&Paper::SCREEN, words));
        let bytes = gif(&frames, &[0.5, 0.04], 1.0).unwrap();
        let mut options = ::gif::DecodeOptions::new();
        options.set_color_output(::gif::ColorOutput::RGBA);
        let mut decoder = options.read_info(&bytes[..]).unwrap();
        let mut delays = Vec::new();
        while let Some(frame) = decoder.read_next_frame().unwrap() {
            delays.push(frame.delay);
            let white = frame.buffer.chunks(4).filter(|p| **p == [255; 4]).count();
            let all = frame.buffer.len() / 4;
            assert!(white > all / 2 && white < all, "{white} of {all}");
        }
        assert_eq!(delays, [50, 4]);
        assert!(gif(&[], &[], 1.0).is_err_and(|e| e.is_domain()));
    }

    /// Catches pages of another size than the paper, and letters that were lost or became outlines.
    #[test]
    fn a_pdf_has_the_size_of_its_paper_and_the_letters_of_its_figure() {
        let paper = Paper {
            width: Some(85.0),
            font: Some(8.0),
        };
        let bytes = pdf(&figure(&paper, WORDS)).unwrap();
        assert!(bytes.starts_with(b"%PDF-"));
        let text = String::from_utf8_lossy(&bytes);
        let (_, page) = text.split_once("/MediaBox [0 0 ").expect("a page");
        let width: f64 = page.split(' ').next().unwrap().parse().unwrap();
        assert!((width - 85.0 * 72.0 / 25.4).abs() < 0.02, "{width}");
        assert!(text.contains("DejaVuSans") && text.contains("/FontFile2"));
        assert!(pdf("no drawing").is_err_and(|e| e.is_domain()));
    }
}
