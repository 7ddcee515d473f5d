//! The secret key of an observation's random streams.

use std::borrow::Cow;
use std::fmt;
use std::str::FromStr;

use rand::TryRng;
use rand::rngs::{SysError, SysRng};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

/// Hexadecimal digits of a key.
const DIGITS: usize = 32;

/// 128 secret bits that key the streams of an observation in addition to their seed. Without them the numbers cannot
/// be reproduced. Written as 32 hexadecimal digits; `Debug` does not reveal them.
#[derive(Clone, Copy, Default, PartialEq, Eq, Hash)]
pub struct ObservationKey([u8; DIGITS / 2]);

/// An invalid key.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("expected {} hexadecimal digits, found {found}", DIGITS)]
pub struct KeyError {
    found: String,
}

impl ObservationKey {
    /// The public key, all zeros: streams depend on their seed alone.
    pub const PUBLIC: Self = Self([0; DIGITS / 2]);

    /// A new secret key from the operating system's entropy.
    ///
    /// # Errors
    /// [`SysError`] if the system provides no entropy.
    pub fn fresh() -> Result<Self, SysError> {
        let mut bytes = [0; DIGITS / 2];
        while bytes == Self::PUBLIC.0 {
            SysRng.try_fill_bytes(&mut bytes)?;
        }
        Ok(Self(bytes))
    }

    /// The key with these bytes.
    pub fn from_bytes(bytes: [u8; DIGITS / 2]) -> Self {
        Self(bytes)
    }

    /// The bytes of the key.
    pub fn bytes(&self) -> [u8; DIGITS / 2] {
        self.0
    }

    /// Whether this is [`Self::PUBLIC`].
    pub fn is_public(&self) -> bool {
        *self == Self::PUBLIC
    }

    /// The key as 32 hexadecimal digits.
    pub fn to_hex(&self) -> String {
        self.0.iter().map(|byte| format!("{byte:02x}")).collect()
    }
}

impl FromStr for ObservationKey {
    type Err = KeyError;

    fn from_str(text: &str) -> Result<Self, KeyError> {
        let refused = |found: String| KeyError { found };
        if text.len() != DIGITS {
            return Err(refused(format!("{} characters", text.chars().count())));
        }
        let mut bytes = [0; DIGITS / 2];
        for (byte, digits) in bytes.iter_mut().zip(text.as_bytes().chunks_exact(2)) {
            let digits =
                std::str::from_utf8(digits).ok().filter(|digits| digits.bytes().all(|d| d.is_ascii_hexdigit()));
            let value = digits.and_then(|digits| u8::from_str_radix(digits, 16).ok());
            *byte = value.ok_or_else(|| refused("a character that is not a hexadecimal digit".to_owned()))?;
        }
        Ok(Self(bytes))
    }
}

impl fmt::Debug for ObservationKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.is_public() { "ObservationKey(public)" } else { "ObservationKey(secret)" })
    }
}

impl Serialize for ObservationKey {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(&self.to_hex())
    }
}

impl<'de> Deserialize<'de> for ObservationKey {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        String::deserialize(from)?.parse().map_err(de::Error::custom)
    }
}

impl JsonSchema for ObservationKey {
    fn schema_name() -> Cow<'static, str> {
        "ObservationKey".into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "string", "pattern": "^[0-9a-fA-F]{32}$" })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_read_back_and_not_revealed_by_debug() {
        let text = "00112233445566778899aabbccddeeff";
        let key: ObservationKey = text.parse().unwrap();
        assert_eq!(key.to_hex(), text);
        assert_eq!(text.to_uppercase().parse(), Ok(key));
        assert_eq!(format!("{key:?}"), "ObservationKey(secret)");
        assert_eq!("0".repeat(32).parse(), Ok(ObservationKey::PUBLIC));
        assert_eq!(serde_json::to_string(&key).unwrap(), format!("\"{text}\""));
        assert_eq!(serde_json::from_str::<ObservationKey>(&format!("\"{text}\"")).unwrap(), key);
    }

    #[test]
    fn invalid_keys_are_refused_without_being_quoted() {
        for (text, found) in [
            ("", "found 0 characters"),
            ("0011", "found 4 characters"),
            ("00112233445566778899aabbccddeefg", "found a character that is not"),
            ("+0112233445566778899aabbccddeeff", "found a character that is not"),
            ("\u{e9}".repeat(16).as_str(), "found"),
        ] {
            let refused = text.parse::<ObservationKey>().unwrap_err().to_string();
            assert!(refused.contains("32 hexadecimal digits") && refused.contains(found), "{refused}");
        }
    }

    #[test]
    fn fresh_keys_differ_from_each_other_and_from_the_public_key() {
        let keys: Vec<ObservationKey> = (0..50).map(|_| ObservationKey::fresh().unwrap()).collect();
        assert!(keys.iter().enumerate().all(|(i, key)| !key.is_public() && !keys[..i].contains(key)));
        let ones: u32 = keys.iter().flat_map(|key| key.bytes()).map(u8::count_ones).sum();
        // 6400 fair bits: 3200 with a standard deviation of 40
        assert!(ones.abs_diff(3200) < 240, "{ones}");
    }
}
