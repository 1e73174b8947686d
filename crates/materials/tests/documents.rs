//! What the documents show is what is compiled.

#[test]
fn adding_a_model_shows_the_example() {
    let folder = env!("CARGO_MANIFEST_DIR");
    let read = |path: &str| std::fs::read_to_string(format!("{folder}/{path}")).unwrap();
    let (document, example) = (read("../../docs/adding-a-model.md"), read("examples/minnaert.rs"));
    assert!(
        document.contains(&format!("```rust\n{example}```\n")),
        "copy the example into docs/adding-a-model.md"
    );
}
