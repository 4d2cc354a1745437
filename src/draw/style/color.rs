//! Colours: read from text, mixed, and written as text.

use std::fmt;

use serde::{Deserialize, Deserializer, de};

use crate::base::cast;

/// A colour, or none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Color(Option<[u8; 3]>);

impl Color {
    /// The colour that draws nothing.
    pub const NONE: Self = Self(None);

    /// The colour of red, green and blue.
    pub const fn of(rgb: [u8; 3]) -> Self {
        Self(Some(rgb))
    }

    /// Red, green and blue; `None` for no colour.
    pub fn rgb(self) -> Option<[u8; 3]> {
        self.0
    }

    /// Reads `#RRGGBB` or `none`.
    pub(super) fn parse(text: &str) -> Option<Self> {
        if text == "none" {
            return Some(Self::NONE);
        }
        let hex = text
            .strip_prefix('#')
            .filter(|h| h.len() == 6 && h.is_ascii())?;
        let byte = |at: usize| u8::from_str_radix(&hex[at..at + 2], 16).ok();
        hex.chars().all(|c| c.is_ascii_hexdigit()).then_some(())?;
        Some(Self(Some([byte(0)?, byte(2)?, byte(4)?])))
    }

    /// The mixture with `part` (0..=1) of a background; itself if one of them is none.
    #[must_use]
    pub(crate) fn faded(self, background: Self, part: f64) -> Self {
        let both = self.0.and(background.0);
        both.map_or(self, |_| self.towards(background, part))
    }

    /// The mixture with `part` (0..=1) of `other`; if one of them is none, the nearer.
    #[must_use]
    pub fn towards(self, other: Self, part: f64) -> Self {
        let (Some(a), Some(b)) = (self.0, other.0) else {
            return if part < 0.5 { self } else { other };
        };
        let mix = |at: usize| {
            let (a, b) = (f64::from(a[at]), f64::from(b[at]));
            cast::to_u8(libm::round(a + (b - a) * part.clamp(0.0, 1.0)))
        };
        Self(Some([mix(0), mix(1), mix(2)]))
    }
}

impl fmt::Display for Color {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some([r, g, b]) => write!(f, "#{r:02X}{g:02X}{b:02X}"),
            None => f.write_str("none"),
        }
    }
}

impl<'de> Deserialize<'de> for Color {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let text = String::deserialize(from)?;
        Self::parse(&text).ok_or_else(|| de::Error::custom("no colour"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_mix() {
        let (black, white) = (
            Color::parse("#000000").unwrap(),
            Color::parse("#ffffff").unwrap(),
        );
        assert_eq!(black.towards(white, 0.5).to_string(), "#808080");
        assert_eq!(Color::NONE.towards(white, 0.6), white);
        assert_eq!(Color::parse("#12345"), None);
        assert_eq!(Color::parse("#+2345f"), None);
    }
}
