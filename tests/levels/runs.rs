//! What the levels below the host's draw is what the host draws.

use std::time::Instant;

use super::common::pictures::{self, Asked};
use super::common::say;
use super::lower::{Lower, Picture, Program};

/// How far apart pictures are: the greatest difference of a value and of a byte, and of the means of the three colours.
#[derive(Debug)]
struct Apart {
    value: f32,
    byte: u8,
    mean: f64,
}

fn apart(a: &Picture, b: &Picture) -> Apart {
    assert_eq!((a.values.len(), a.bytes.len()), (b.values.len(), b.bytes.len()), "pictures of a size");
    let values = a.values.iter().flatten().zip(b.values.iter().flatten());
    let mean = |p: &Picture, c: usize| p.values.iter().map(|v| f64::from(v[c])).sum::<f64>() / p.values.len() as f64;
    Apart {
        value: values.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max),
        byte: a.bytes.iter().zip(&b.bytes).map(|(a, b)| a.abs_diff(*b)).max().unwrap(),
        mean: (0..3).map(|c| (mean(a, c) - mean(b, c)).abs()).fold(0.0, f64::max),
    }
}

/// The bound that pictures of other numbers of lanes are held to.
fn check_same(program: &Program, lower: &Lower, asked: &Asked) {
    let started = Instant::now();
    let (native, made) =
        rayon::join(|| program.render(None, &asked.request), || program.render(Some(lower), &asked.request));
    assert!(native.bytes.iter().any(|v| *v != native.bytes[0]), "{}: nothing is seen", asked.name);
    let apart = apart(&native, &made);
    println!("{} {}: {apart:?} in {:.1} s", lower.level.name, asked.name, started.elapsed().as_secs_f64());
    let said = format!("{} at {}: {apart:?}", asked.name, lower.level.name);
    assert!(apart.value < 1.0 / 255.0 && apart.byte <= 1 && apart.mean < 1e-4, "{said}");
}

/// The first of the list for each technique; the program itself knows the volumes of these.
fn one_of_each_technique() -> Vec<Asked> {
    let mut found: Vec<Asked> = Vec::new();
    for asked in pictures::list().into_iter().filter(|a| !a.needs_house()) {
        if !found.iter().any(|known| known.technique() == asked.technique()) {
            found.push(asked);
        }
    }
    assert_eq!(found.len(), cloudchamber::technique::ALL.len());
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

#[test]
fn a_picture_of_other_values_is_seen_to_be_another() {
    let picture = |value: f32, byte: u8| Picture { values: vec![[value; 3]; 4], bytes: vec![byte; 12] };
    let found = apart(&picture(0.5, 9), &picture(0.25, 6));
    assert_eq!((found.value, found.byte), (0.25, 3));
    assert!((found.mean - 0.25).abs() < 1e-9);
}
