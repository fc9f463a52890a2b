//! The pictures of the levels below the host's are the host's pictures.

use cloudchamber::technique;
use std::time::Instant;

use super::lower::{Lower, Program};
use crate::common::pictures::{self, Asked};
use crate::common::say;

/// Checks the bound on pictures of other numbers of lanes.
fn check_same(program: &Program, lower: &Lower, asked: &Asked) {
    let started = Instant::now();
    let (native, made) =
        rayon::join(|| program.render(None, &asked.request), || program.render(Some(lower), &asked.request));
    assert!(native.shows_something(), "{}: nothing is seen", asked.name);
    let (level, took) = (lower.level.name, started.elapsed().as_secs_f64());
    println!("{level} {}: {:?} in {took:.1} s", asked.name, made.difference(&native));
    let other = made.other_than(&native);
    assert!(other.is_none(), "{} at {level}: {}", asked.name, other.unwrap_or_default());
}

/// The first request of the list for each technique. The program itself knows their volumes.
fn one_of_each_technique() -> Vec<Asked> {
    let mut found: Vec<Asked> = Vec::new();
    for asked in pictures::list().into_iter().filter(|a| !a.needs_house()) {
        if !found.iter().any(|known| known.technique() == asked.technique()) {
            found.push(asked);
        }
    }
    assert_eq!(found.len(), technique::views().chain(technique::fields()).count());
    found
}

#[test]
fn a_tiny_picture_is_the_same_at_the_level_below() {
    let program = Program::new();
    let Some(lower) = program.levels_below().first().copied() else {
        return say("not run: a picture at the level below the host's, for there is none");
    };
    check_same(&program, lower, &one_of_each_technique()[0]);
}

#[test]
fn a_picture_of_each_technique_is_the_same_at_each_level_below() {
    if !super::is_full() {
        return say(
            "not run: a picture of each technique at each level below the host's (./dev test --full makes them)",
        );
    }
    let program = Program::new();
    let below = program.levels_below();
    if below.is_empty() {
        say("not run: pictures at the levels below the host's, for there are none");
    }
    for lower in below {
        for asked in one_of_each_technique() {
            check_same(&program, lower, &asked);
        }
    }
}
