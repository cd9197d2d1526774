//! Lines of JSON as requests have them: an id that stays as it is written, and no key twice.

use crate::lang;
use serde::de::{Deserialize, Deserializer, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde_json::value::RawValue;
use serde_json::{Map, Value};
use std::fmt;

/// The text of the field `id` of the object that `line` is; `None` if it has none, or several.
pub(super) fn id(line: &[u8]) -> Option<&RawValue> {
    serde_json::from_slice(line).ok().and_then(|Outline(id)| id)
}

/// `line` as a value.
///
/// # Errors
/// Of the category [`Data`](serde_json::error::Category::Data) for a key that an object has twice,
/// of another one for what is no JSON.
pub(super) fn value(line: &[u8]) -> serde_json::Result<Value> {
    serde_json::from_slice(line).map(|Distinct(value)| value)
}

/// An object's field `id`.
struct Outline<'a>(Option<&'a RawValue>);

impl<'de> Deserialize<'de> for Outline<'de> {
    fn deserialize<D: Deserializer<'de>>(source: D) -> Result<Self, D::Error> {
        struct Fields;
        impl<'de> Visitor<'de> for Fields {
            type Value = Outline<'de>;

            fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
                out.write_str("an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut id = None;
                while let Some(key) = map.next_key::<String>()? {
                    if key != "id" {
                        map.next_value::<IgnoredAny>()?;
                    } else if id.replace(map.next_value()?).is_some() {
                        return Err(twice(&key));
                    }
                }
                Ok(Outline(id))
            }
        }
        source.deserialize_map(Fields)
    }
}

/// A value whose objects have no key twice.
struct Distinct(Value);

impl<'de> Deserialize<'de> for Distinct {
    fn deserialize<D: Deserializer<'de>>(source: D) -> Result<Self, D::Error> {
        struct Any;
        impl<'de> Visitor<'de> for Any {
            type Value = Distinct;

            fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
                out.write_str("JSON")
            }

            fn visit_unit<E: Error>(self) -> Result<Distinct, E> {
                Ok(Distinct(Value::Null))
            }

            fn visit_bool<E: Error>(self, value: bool) -> Result<Distinct, E> {
                Ok(Distinct(value.into()))
            }

            fn visit_u64<E: Error>(self, value: u64) -> Result<Distinct, E> {
                Ok(Distinct(value.into()))
            }

            fn visit_i64<E: Error>(self, value: i64) -> Result<Distinct, E> {
                Ok(Distinct(value.into()))
            }

            fn visit_f64<E: Error>(self, value: f64) -> Result<Distinct, E> {
                Ok(Distinct(value.into()))
            }

            fn visit_str<E: Error>(self, value: &str) -> Result<Distinct, E> {
                Ok(Distinct(value.into()))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Distinct, A::Error> {
                let mut values = Vec::new();
                while let Some(Distinct(value)) = list.next_element()? {
                    values.push(value);
                }
                Ok(Distinct(values.into()))
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Distinct, A::Error> {
                let mut fields = Map::new();
                while let Some(key) = map.next_key::<String>()? {
                    if fields.contains_key(&key) {
                        return Err(twice(&key));
                    }
                    let Distinct(value) = map.next_value()?;
                    fields.insert(key, value);
                }
                Ok(Distinct(fields.into()))
            }
        }
        source.deserialize_any(Any)
    }
}

/// The complaint about a second `key`.
fn twice<E: Error>(key: &str) -> E {
    E::custom(format_args!("`{}` is given twice", lang::shortened(key.to_owned())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_those_of_the_library_where_no_key_is_twice() {
        for text in [
            "null",
            "true",
            "-0",
            "-7",
            "18446744073709551615",
            "12345678901234567890123",
            "0.1",
            "-0.0",
            r#""a\u00e9\n""#,
            r#"[1, [], {}, [{"a": {"a": 1}, "b": [null]}]]"#,
        ] {
            let expected: Value = serde_json::from_str(text).unwrap();
            assert_eq!(value(text.as_bytes()).unwrap(), expected, "{text}");
        }
        for text in ["", "1 2", "[1", "{\"a\": 1e999}", "\"\\ud800\""] {
            assert!(!value(text.as_bytes()).unwrap_err().is_data(), "{text}");
        }
        for text in [r#"{"a": 1, "a": 1}"#, r#"[{"b": {"a": 1, "a": 2}}]"#, r#"{"\u0061":1,"a":1}"#]
        {
            let error = value(text.as_bytes()).unwrap_err();
            assert!(
                error.is_data() && error.to_string().starts_with("`a` is given twice"),
                "{error}"
            );
        }
    }
}
