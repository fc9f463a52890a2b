//! `/openapi.json` and `/docs/`: the document is well formed, and it agrees with the routes.

use std::collections::BTreeSet;

use reqwest::Method;
use serde_json::{Value, json};

use crate::support::*;

const METHODS: [&str; 4] = ["get", "post", "put", "delete"];

/// The method and path of every route in the source. `/docs` describes itself.
fn routes() -> BTreeSet<(String, String)> {
    let source = include_str!("../../../src/http/routes.rs");
    let mut routes = BTreeSet::new();
    for route in source.split(".route(\"").skip(1) {
        let (path, rest) = route.split_once('"').unwrap();
        let handlers = rest.lines().next().unwrap();
        for method in METHODS {
            if handlers.contains(&format!(" {method}(")) || handlers.contains(&format!(".{method}(")) {
                routes.insert((method.to_owned(), path.to_owned()));
            }
        }
    }
    routes.retain(|(_, path)| !path.starts_with("/docs"));
    assert!(routes.len() > 15, "the routes are no longer found: {routes:?}");
    routes
}

fn operations(document: &Value) -> Vec<(&str, &str, &Value)> {
    let paths = document["paths"].as_object().unwrap().iter();
    paths
        .flat_map(|(p, item)| item.as_object().unwrap().iter().map(move |(m, o)| (m.as_str(), p.as_str(), o)))
        .collect()
}

/// Every `$ref` in the document.
fn references<'v>(value: &'v Value, found: &mut Vec<&'v str>) {
    match value {
        Value::Object(map) => {
            found.extend(map.get("$ref").and_then(Value::as_str));
            map.values().for_each(|v| references(v, found));
        }
        Value::Array(list) => list.iter().for_each(|v| references(v, found)),
        _ => {}
    }
}

#[tokio::test]
async fn the_document_is_openapi_3_1() {
    let server = shared();
    let document = Api::new(&server).get_json("/openapi.json").await;
    assert!(document["openapi"].as_str().unwrap().starts_with("3.1."));
    assert!(document["info"]["title"].is_string() && document["info"]["version"].is_string());
    let mut references_found = Vec::new();
    references(&document, &mut references_found);
    for reference in references_found {
        let pointer = reference.strip_prefix('#').unwrap_or_else(|| panic!("{reference} leads out of the document"));
        assert!(document.pointer(pointer).is_some(), "{reference} leads nowhere");
    }
    for (name, schema) in document["components"]["schemas"].as_object().unwrap() {
        jsonschema::validator_for(schema).unwrap_or_else(|e| panic!("{name} is no JSON Schema: {e}"));
    }
    for (method, path, operation) in operations(&document) {
        assert!(path.starts_with('/') && METHODS.contains(&method), "{method} {path}");
        assert!(operation["summary"].as_str().is_some_and(|s| !s.is_empty()), "{method} {path}");
        let responses = operation["responses"].as_object().unwrap();
        assert!(responses.keys().any(|status| status.starts_with(['2', '3'])), "{method} {path} never succeeds");
        for (status, response) in responses {
            assert!(status.parse::<u16>().is_ok_and(|s| (100..600).contains(&s)), "{status}");
            assert!(response["description"].is_string() || response["$ref"].is_string(), "{method} {path} {status}");
        }
        let declared: Vec<_> = operation["parameters"].as_array().unwrap().iter().collect();
        for parameter in &declared {
            assert!(["path", "query", "header"].contains(&parameter["in"].as_str().unwrap()));
            assert!(parameter["schema"].is_object(), "{parameter}");
        }
        let in_path: Vec<_> =
            declared.iter().filter(|p| p["in"] == "path").map(|p| p["name"].as_str().unwrap()).collect();
        let in_template: Vec<_> = path.split(['{', '}']).skip(1).step_by(2).collect();
        assert_eq!(in_path, in_template, "{method} {path}");
        assert!(declared.iter().filter(|p| p["in"] == "path").all(|p| p["required"] == true));
    }
}

#[tokio::test]
async fn every_route_is_in_the_document_and_the_other_way_round() {
    let server = shared();
    let document = Api::new(&server).get_json("/openapi.json").await;
    let described: BTreeSet<_> =
        operations(&document).iter().map(|(m, p, _)| ((*m).to_owned(), (*p).to_owned())).collect();
    assert_eq!(described, routes());
}

#[tokio::test]
async fn every_operation_of_the_document_is_answered() {
    let server = shared();
    let api = Api::new(&server);
    let document = api.get_json("/openapi.json").await;
    for (method, path, operation) in operations(&document) {
        let request =
            api.request(Method::from_bytes(method.to_uppercase().as_bytes()).unwrap(), &path.replace("{id}", "0"));
        let request = if operation.get("requestBody").is_some() { request.json(&json!({})) } else { request };
        let response = request.send().await.unwrap();
        let status = response.status().as_u16();
        assert!(
            operation["responses"].get(status.to_string()).is_some(),
            "{method} {path} gave {status}, which is not described"
        );
        assert_ne!(status, 405, "{method} {path}");
        if status == 404 {
            let words = problem(response, 404, path).await["detail"].as_str().unwrap().to_owned();
            assert!(words.contains("'0'") && !words.contains("no path"), "{method} {path} fell through: {words}");
        }
    }
    let fallen = problem(api.get("/v1/nowhere/0").await, 404, "an unknown path").await;
    assert!(
        fallen["detail"].as_str().unwrap().contains("no path"),
        "an unknown path can be told from an unknown id: {fallen}"
    );
}

#[tokio::test]
async fn answers_are_what_the_document_says() {
    let server = shared();
    let api = Api::new(&server);
    let document = api.get_json("/openapi.json").await;
    let volumes = jsonschema::validator_for(&document["components"]["schemas"]["Volume"]).unwrap();
    let list = api.get_json("/v1/volumes").await;
    let shown = api.get_json("/v1/volumes/gaussian").await;
    for volume in list["volumes"].as_array().unwrap().iter().chain([&shown]) {
        let errors: Vec<_> = volumes.iter_errors(volume).map(|e| e.to_string()).collect();
        assert!(errors.is_empty(), "{volume}: {errors:?}");
    }
    let problems = jsonschema::validator_for(&document["components"]["schemas"]["Problem"]).unwrap();
    let refused = problem(api.post(&json!({"technique": 7}), "image/png").await, 422, "a bad request").await;
    assert!(problems.is_valid(&refused), "{refused}");
}

#[tokio::test]
async fn the_documentation_page_loads_with_all_its_parts() {
    let server = shared();
    let api = Api::new(&server);
    let page = api.get("/docs").await;
    assert_eq!(page.url().path(), "/docs/", "to where relative links work");
    assert_eq!(page.status(), 200);
    let html = page.text().await.unwrap();
    assert!(html.contains("swagger-ui"));
    let mut parts = 0;
    for rest in html.split(['"', '\'']).filter(|t| t.ends_with(".js") || t.ends_with(".css")) {
        let path = format!("/docs/{}", rest.trim_start_matches("./"));
        assert_eq!(api.get(&path).await.status(), 200, "{path}");
        parts += 1;
    }
    assert!(parts >= 3, "{html}");
    assert!(api.get("/docs/swagger-initializer.js").await.text().await.unwrap().contains("/openapi.json"));
    problem(api.get("/docs/nothing.js").await, 404, "a part that is not there").await;
}
