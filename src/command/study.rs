//! `study`: measures speed against accuracy, and the limits of the methods.

use std::path::PathBuf;

use crate::config::{DeviceArgs, Limits};
use crate::error::{Error, Result};
use crate::study;
use crate::study::results::{HONESTY, PLANNER, Results, STABILITY};

/// What `study` is told.
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Only this case
    #[arg(long)]
    case: Option<String>,
    /// Fewer settings and seeds: seconds a case
    #[arg(long)]
    quick: bool,
    /// Which of the random scenes of `planner` or `honesty`, as 20..40 (default: 110 and 420 of them, or 10 and 40 if quick)
    #[arg(long, value_parser = study::planner::scenes)]
    scenes: Option<std::ops::Range<u64>>,
    /// Where the results go, a JSON a case (default: studies in the data folder)
    #[arg(short, long)]
    output: Option<PathBuf>,
    #[command(flatten)]
    pub device: DeviceArgs,
    #[command(flatten)]
    limits: Limits,
}

/// Runs the cases asked for and stores their results.
///
/// # Errors
/// Those of the requests and of the folder, and one if a method is wrong and silent.
pub(super) fn study(args: &Arguments) -> Result<()> {
    let asked = |name: &str| args.case.as_deref().is_none_or(|case| case == name);
    let all_experiments = asked(STABILITY);
    let experiment = |e: &study::experiments::Experiment| all_experiments || asked(e.name);
    let cases: Vec<&study::Case> = study::CASES.iter().filter(|c| asked(c.name)).collect();
    let experiments = study::experiments::EXPERIMENTS;
    if cases.is_empty() && !experiments.iter().any(experiment) && !asked(PLANNER) && !asked(HONESTY) {
        let names: Vec<&str> = study::CASES
            .iter()
            .map(|c| c.name)
            .chain([STABILITY, PLANNER, HONESTY])
            .chain(experiments.iter().map(|e| e.name))
            .collect();
        return Err(Error::internal(format!("there is no such case; there are: {}", names.join(", "))));
    }
    let results = Results::new(args.output.clone().unwrap_or_else(|| args.device.data_dir().join("studies")));
    let bench = study::bench::Bench::new(&args.device, args.limits.clone())?;
    let scale = if args.quick { study::Scale::Quick } else { study::Scale::Full };
    let mut told = |line: &str| eprintln!("{line}");
    for case in cases {
        match study::study(&bench, case, scale, &mut told)? {
            Ok(record) => {
                results.put(&record)?;
                print!("{}", study::table(&record));
            }
            Err(why) => println!("{}: left out: {why}", case.name),
        }
    }
    if experiments.iter().any(experiment) {
        let found = study::stability::stability(&bench, scale, &experiment, &mut told)?;
        print!("{}", found.page());
        if let Some(silent) = found.experiments.iter().find(|e| !e.verdict.is_told()) {
            return Err(Error::internal(format!("{}: a method is wrong and silent", silent.name)));
        }
        results.put_stability(found)?;
    }
    if asked(PLANNER) {
        let scenes = args.scenes.clone().unwrap_or(0..scale.pick(10, 110));
        for scene in scenes {
            // Each result is written at once, since all of them take long.
            let all = results.put_planned(study::planner::planner(&bench, scene..scene + 1, &mut told)?)?;
            let ([met, timed, cheap], n) = (all.figures(), all.scenes.len());
            told(&format!("of {n} plans {met} meet the error, {timed} the time, {cheap} the cost"));
        }
    }
    if asked(HONESTY) {
        for scene in args.scenes.clone().unwrap_or(0..scale.pick(40, 420)) {
            let quick = scale == study::Scale::Quick;
            results.put_honesty(study::honesty::honesty(&bench, scene..scene + 1, quick, &mut told)?)?;
        }
    }
    println!("written to {}", results.folder().display());
    Ok(())
}
