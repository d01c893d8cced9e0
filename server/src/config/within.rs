//! Numbers that carry their allowed range in their type, so that whoever parses one also checks it.

use std::fmt;
use std::str::FromStr;

use serde::{
    Deserialize, Deserializer,
    de::{Error, Unexpected, Visitor},
};

/// An integer from `MIN` to `MAX`, in the unit that the key's name says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Within<const MIN: u32, const MAX: u32>(u32);

impl<const MIN: u32, const MAX: u32> Within<MIN, MAX> {
    /// The number.
    pub fn get(self) -> u32 {
        self.0
    }
}

impl<const MIN: u32, const MAX: u32> FromStr for Within<MIN, MAX> {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let within = text.parse().ok().filter(|number| (MIN..=MAX).contains(number));
        within.map(Self).ok_or_else(|| format!("allowed is an integer from {MIN} to {MAX}"))
    }
}

impl<'de, const MIN: u32, const MAX: u32> Deserialize<'de> for Within<MIN, MAX> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Range<const MIN: u32, const MAX: u32>;
        impl<const MIN: u32, const MAX: u32> Visitor<'_> for Range<MIN, MAX> {
            type Value = Within<MIN, MAX>;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                write!(f, "an integer from {MIN} to {MAX}")
            }
            fn visit_i64<E: Error>(self, number: i64) -> Result<Self::Value, E> {
                let within = u32::try_from(number).ok().filter(|n| (MIN..=MAX).contains(n));
                within.map(Within).ok_or_else(|| E::invalid_value(Unexpected::Signed(number), &self))
            }
        }
        deserializer.deserialize_i64(Range)
    }
}

/// The tick rates that the game is tuned for: 30 Hz, and 25 Hz as in Europe's television.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TickRate(u16);

impl TickRate {
    /// What is allowed, for messages.
    pub const ALLOWED: &str = "30 or 25";

    /// Ticks a second.
    pub fn hz(self) -> u16 {
        self.0
    }
}

impl TryFrom<i64> for TickRate {
    type Error = String;
    fn try_from(hz: i64) -> Result<Self, String> {
        match hz {
            30 => Ok(Self(30)),
            25 => Ok(Self(25)),
            _ => Err(format!("{hz} Hz is no tick rate, allowed are {} Hz", Self::ALLOWED)),
        }
    }
}

impl std::str::FromStr for TickRate {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let hz: i64 = text.parse().map_err(|_| format!("{text} is no tick rate, allowed are {} Hz", Self::ALLOWED))?;
        Self::try_from(hz)
    }
}

impl<'de> Deserialize<'de> for TickRate {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Rate;
        impl Visitor<'_> for Rate {
            type Value = TickRate;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str(TickRate::ALLOWED)
            }
            fn visit_i64<E: Error>(self, hz: i64) -> Result<TickRate, E> {
                TickRate::try_from(hz).map_err(|_| E::invalid_value(Unexpected::Signed(hz), &self))
            }
        }
        deserializer.deserialize_i64(Rate)
    }
}

/// Ticks from one keyframe of a cell to the next: a power of two, because layers of a cell each halve the rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KeyframeTicks {
    log2: u8,
}

impl KeyframeTicks {
    /// The power.
    pub fn log2(self) -> u8 {
        self.log2
    }
}

impl<'de> Deserialize<'de> for KeyframeTicks {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Power;
        impl Visitor<'_> for Power {
            type Value = KeyframeTicks;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("1, 2, 4, 8, 16 or 32")
            }
            fn visit_i64<E: Error>(self, ticks: i64) -> Result<KeyframeTicks, E> {
                let log2 = (0..6).find(|log2| 1 << log2 == ticks);
                log2.map(|log2| KeyframeTicks { log2 })
                    .ok_or_else(|| E::invalid_value(Unexpected::Signed(ticks), &self))
            }
        }
        deserializer.deserialize_i64(Power)
    }
}
