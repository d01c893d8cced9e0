//! A figure of a verdict, for machines and for people.

use std::fmt::{self, Display, Formatter};

/// A number that says how good a trace is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figure {
    /// For people: a word.
    pub label: &'static str,
    /// For machines: what it is, with its SI unit.
    pub key: &'static str,
    /// In that SI unit.
    pub value: f64,
    /// How people read it.
    pub unit: Unit,
}

/// How people read a figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// m.
    Metres,
    /// m, shown in mm.
    Millimetres,
    /// m/s.
    MetresPerSecond,
    /// m/s, shown in mm/s.
    MillimetresPerSecond,
    /// No unit, shown in %.
    Percent,
}

impl Unit {
    fn scale_and_symbol(self) -> (f64, &'static str) {
        match self {
            Self::Metres => (1.0, "m"),
            Self::Millimetres => (1e3, "mm"),
            Self::MetresPerSecond => (1.0, "m/s"),
            Self::MillimetresPerSecond => (1e3, "mm/s"),
            Self::Percent => (100.0, "%"),
        }
    }
}

impl Display for Figure {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let (scale, symbol) = self.unit.scale_and_symbol();
        write!(f, "{} {} {symbol}", self.label, three_digits(self.value * scale))
    }
}

/// `x` to three significant digits.
pub fn three_digits(x: f64) -> String {
    let digits_before_point = x.abs().log10().floor();
    match digits_before_point {
        _ if x == 0.0 || !x.is_finite() => x.to_string(),
        // 2 to 6 decimals, all within the range of the cast.
        -4.0..3.0 => format!("{x:.0$}", (2.0 - digits_before_point) as usize),
        3.0..6.0 => format!("{x:.0}"),
        _ => format!("{x:.2e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_have_three_digits() {
        for (x, text) in [
            (0.0, "0"),
            (0.001_234_5, "0.00123"),
            (-0.5, "-0.500"),
            (14.94, "14.9"),
            (147.4, "147"),
            (98_765.0, "98765"),
            (1.23e-12, "1.23e-12"),
            (-4.56e7, "-4.56e7"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(three_digits(x), text);
        }
        let figure = Figure { label: "gap", key: "gap_max_m", value: 0.0048, unit: Unit::Millimetres };
        assert_eq!(figure.to_string(), "gap 4.80 mm");
    }
}
