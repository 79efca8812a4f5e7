//! The size of a figure in print.

use super::axes::LABEL;
use snaprod_core::error::{Error, Result};

/// Size and lettering of a printed figure. The default is a screen: the panels have their natural size, in pixels.
///
/// ```
/// use snaprod_plot::Paper;
///
/// // A column of a journal with letters as large as those of its captions.
/// let column = Paper { width: Some(85.0), font: Some(8.0) };
/// assert!(column.check().is_ok());
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Paper {
    /// Width of the whole figure in millimetres; by default the natural width of its panels at the size of
    /// its letters.
    pub width: Option<f64>,
    /// Size of the letters of axis names, in points (1/72 inch); numbers at the axes are an eighth smaller.
    /// By default 8 if a width is given.
    pub font: Option<f64>,
}

/// Size of letters if only a width is given, in points.
const FONT: f64 = 8.0;
/// Least width of a figure with axes, in letters of its axes' names.
const NARROWEST: f64 = 17.0;
const MILLIMETRES_IN_POINT: f64 = 25.4 / 72.0;

/// Conversion of the pixels of a figure to millimetres.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Print {
    /// Millimetres in a pixel.
    pub pixel: f64,
    /// Width of the figure in pixels, if given.
    pub width: Option<f64>,
}

impl Paper {
    /// No paper: the same as the default.
    pub const SCREEN: Self = Self {
        width: None,
        font: None,
    };

    /// Refuses sizes that cannot be printed: letters not of 2 to 100 pt, figures without room for axes in
    /// such letters, figures more than ten metres wide.
    pub fn check(&self) -> Result<()> {
        self.print().map(drop)
    }

    /// The conversion to millimetres; None on a screen.
    pub(crate) fn print(&self) -> Result<Option<Print>> {
        if *self == Self::SCREEN {
            return Ok(None);
        }
        let font = self.font.unwrap_or(FONT);
        if !(2.0..=100.0).contains(&font) {
            return Err(Error::domain(format!(
                "a figure with letters of {font} pt: give 2 to 100 pt"
            )));
        }
        let letter = font * MILLIMETRES_IN_POINT;
        let pixel = letter / LABEL;
        let least = NARROWEST * letter;
        match self.width {
            Some(width) if !(width >= least && width <= 1e4) => Err(Error::domain(format!(
                "a figure {width} mm wide with letters of {font} pt: give {least:.0} to 10000 mm, or smaller letters"
            ))),
            width => Ok(Some(Print {
                pixel,
                width: width.map(|width| width / pixel),
            })),
        }
    }
}
