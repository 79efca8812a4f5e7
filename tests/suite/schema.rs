//! The reference of scenes and their JSON schema.

use serde_json::Value;
use std::fs;
use std::path::Path;

/// Catches a reference out of date with the tables; `snaprod schema --markdown > docs/scene.md` renews it.
#[test]
fn the_reference_is_up_to_date() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/scene.md");
    let written = std::fs::read_to_string(path).unwrap();
    assert!(
        written == snaprod::scene::reference(),
        "docs/scene.md is stale"
    );
    let schema = snaprod::scene::json_schema();
    assert_eq!(
        schema["properties"]["run"]["properties"]["samples"]["default"],
        400
    );
    assert_eq!(
        schema["properties"]["body"]["properties"]["mass"]["anyOf"][0]["exclusiveMinimum"],
        0
    );
}

/// Reason why a value does not match a schema with these few keywords; `None` for a match.
fn misfit(schema: &Value, value: &Value) -> Option<String> {
    let wrong = |why: &str| Some(format!("{value}: {why}"));
    if let Some(all) = schema["anyOf"].as_array()
        && all.iter().all(|one| misfit(one, value).is_some())
    {
        return wrong(&format!("none of {all:?}"));
    }
    if let Some(words) = schema["enum"].as_array()
        && !words.contains(value)
    {
        return wrong("not among the words");
    }
    let fits = match schema["type"].as_str() {
        None => true,
        Some("object") => value.is_object(),
        Some("array") => value.is_array(),
        Some("string") => value.is_string(),
        Some("boolean") => value.is_boolean(),
        Some("number") => value.is_number(),
        Some("integer") => value.is_i64() || value.is_u64(),
        Some(other) => panic!("a type {other}"),
    };
    if !fits {
        return wrong("of another type");
    }
    let bound = |key: &str| schema[key].as_f64();
    if let Some(x) = value.as_f64()
        && (bound("minimum").is_some_and(|least| x < least)
            || bound("maximum").is_some_and(|most| x > most)
            || bound("exclusiveMinimum").is_some_and(|least| x <= least))
    {
        return wrong("out of bounds");
    }
    if let Some(list) = value.as_array() {
        let count = list.len() as f64;
        if bound("minItems").is_some_and(|least| count < least)
            || bound("maxItems").is_some_and(|most| count > most)
        {
            return wrong("of another length");
        }
        return list.iter().find_map(|item| misfit(&schema["items"], item));
    }
    value
        .as_object()?
        .iter()
        .find_map(|(name, inner)| match schema["properties"].get(name) {
            Some(schema) => misfit(schema, inner).map(|why| format!("{name}: {why}")),
            None if schema["additionalProperties"] == false => wrong(&format!("no field {name}")),
            None => None,
        })
}

/// Catches a schema that rejects valid scenes in an editor, such as a rest curvature of 0 or below.
#[test]
fn scenes_fit_the_schema() {
    let schema = snaprod::scene::json_schema();
    let mut seen = 0;
    for file in fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes")).unwrap() {
        let path = file.unwrap().path();
        let text = fs::read_to_string(&path).unwrap();
        let scene: Value = toml::from_str(&text).unwrap();
        assert_eq!(misfit(&schema, &scene), None, "{}", path.display());
        let typing = text.replacen("\nmodel =", "\nmodell =", 1);
        let typing = typing.replacen("\nradius =", "\nradiuss =", 1);
        let typing = typing.replacen("\nmass =", "\nmas =", 1);
        let scene: Value = toml::from_str(&typing).unwrap();
        assert!(misfit(&schema, &scene).is_some(), "{}", path.display());
        seen += 1;
    }
    assert!(seen > 20, "{seen}");
}
