//! A program has only the parts that its features need.

use cloudchamber::technique::emission_absorption::TECHNIQUE;

use crate::device::builds::preprocessed;

#[test]
fn what_a_variant_does_without_is_not_in_its_program() {
    let source = (TECHNIQUE.source)();
    for variant in (source.variants)() {
        let text = preprocessed(&source, &variant);
        for (feature, code) in
            [("SHADED", "o.colour = shade("), ("STYLED", "styled_step("), ("PREINTEGRATED", "integral(")]
        {
            let wanted = variant.features.contains(&(feature, 1));
            assert_eq!(text.contains(code), wanted, "{}: {code}", variant.label());
        }
    }
}
