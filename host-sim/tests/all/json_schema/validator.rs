//! Validator for the few keywords of JSON Schema (draft 2020-12) that docs/json.schema.json uses.
//!
//! It refuses any other keyword: none goes unheeded.

use serde_json::{Map, Value};

/// Schema with its definitions.
pub struct Schema(Value);

impl Schema {
    pub fn parse(text: &str) -> Self {
        Self(serde_json::from_str(text).unwrap())
    }

    /// Schemas of the documents, one of which holds.
    pub fn documents(&self) -> Vec<&Value> {
        let of = |reference: &Value| self.definition(reference.as_str().unwrap());
        self.0["oneOf"].as_array().unwrap().iter().map(|it| of(&it["$ref"])).collect()
    }

    /// Faults of a document, each with its place; none if it is valid.
    pub fn faults(&self, document: &Value) -> Vec<String> {
        let mut faults = Vec::new();
        self.check(&self.0, document, "", &mut faults);
        faults
    }

    fn definition(&self, reference: &str) -> &Value {
        let name = reference.strip_prefix("#/$defs/").unwrap();
        self.0["$defs"].get(name).unwrap_or_else(|| panic!("{reference} is not defined"))
    }

    fn check(&self, schema: &Value, value: &Value, at: &str, faults: &mut Vec<String>) {
        let schema = schema.as_object().unwrap();
        for (keyword, rule) in schema {
            let holds = match keyword.as_str() {
                "$schema" | "$defs" | "title" | "description" => true,
                "$ref" => {
                    self.check(self.definition(rule.as_str().unwrap()), value, at, faults);
                    true
                }
                "type" => match rule {
                    Value::Array(types) => types.iter().any(|it| is_of_type(value, it)),
                    one => is_of_type(value, one),
                },
                "const" => value == rule,
                "enum" => rule.as_array().unwrap().contains(value),
                "pattern" => value.as_str().is_none_or(|text| is_hexadecimal(text, rule)),
                "minimum" => value.as_f64().is_none_or(|number| number >= rule.as_f64().unwrap()),
                "minItems" => value.as_array().is_none_or(|it| it.len() >= size(rule)),
                "maxItems" => value.as_array().is_none_or(|it| it.len() <= size(rule)),
                "items" => {
                    for (i, item) in value.as_array().into_iter().flatten().enumerate() {
                        self.check(rule, item, &format!("{at}/{i}"), faults);
                    }
                    true
                }
                "required" | "properties" | "additionalProperties" => {
                    if let Some(object) = value.as_object() {
                        self.keys(keyword, schema, object, at, faults);
                    }
                    true
                }
                "oneOf" => {
                    self.one_of(rule.as_array().unwrap(), value, at, faults);
                    true
                }
                other => panic!("the validator does not know the keyword {other}"),
            };
            if !holds {
                faults.push(format!("{at}: {value} breaks {keyword} {rule}"));
            }
        }
    }

    /// Checks the keys of an `object` by one `keyword` of its `schema`.
    fn keys(
        &self,
        keyword: &str,
        schema: &Map<String, Value>,
        object: &Map<String, Value>,
        at: &str,
        faults: &mut Vec<String>,
    ) {
        let properties = schema["properties"].as_object().unwrap();
        match keyword {
            "required" => {
                let required = schema[keyword].as_array().unwrap().iter();
                let absent = required.filter(|key| !object.contains_key(key.as_str().unwrap()));
                faults.extend(absent.map(|key| format!("{at}: {key} is missing")));
            }
            "properties" => {
                for (key, rule) in properties {
                    if let Some(value) = object.get(key) {
                        self.check(rule, value, &format!("{at}/{key}"), faults);
                    }
                }
            }
            _ => {
                assert_eq!(schema[keyword], false);
                let unknown = object.keys().filter(|key| !properties.contains_key(*key));
                faults.extend(unknown.map(|key| format!("{at}: {key} is not in the schema")));
            }
        }
    }

    /// Checks that exactly one of `schemas` holds; where none does, the faults are those of the nearest one.
    fn one_of(&self, schemas: &[Value], value: &Value, at: &str, faults: &mut Vec<String>) {
        let of_each = schemas.iter().map(|schema| {
            let mut faults = Vec::new();
            self.check(schema, value, at, &mut faults);
            faults
        });
        let mut of_each: Vec<Vec<String>> = of_each.collect();
        match of_each.iter().filter(|faults| faults.is_empty()).count() {
            0 => {
                of_each.sort_by_key(Vec::len);
                faults.append(&mut of_each[0]);
            }
            1 => {}
            holding => faults.push(format!("{at}: {holding} schemas hold, not one")),
        }
    }
}

fn is_of_type(value: &Value, name: &Value) -> bool {
    match name.as_str().unwrap() {
        "null" => value.is_null(),
        "boolean" => value.is_boolean(),
        "integer" => value.is_u64() || value.is_i64(),
        "number" => value.is_number(),
        "string" => value.is_string(),
        "array" => value.is_array(),
        "object" => value.is_object(),
        other => panic!("{other} is no type"),
    }
}

/// Whether a text is so many hexadecimal digits: the only pattern in use.
fn is_hexadecimal(text: &str, pattern: &Value) -> bool {
    let digits = pattern.as_str().unwrap().strip_prefix("^[0-9a-f]{");
    let digits = digits.and_then(|it| it.strip_suffix("}$")).and_then(|it| it.parse().ok());
    let digits: usize = digits.unwrap_or_else(|| panic!("the validator does not know {pattern}"));
    text.len() == digits && text.bytes().all(|c| c.is_ascii_digit() || (b'a'..=b'f').contains(&c))
}

fn size(rule: &Value) -> usize {
    usize::try_from(rule.as_u64().unwrap()).unwrap()
}
