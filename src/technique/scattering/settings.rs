//! The settings of scattering views: the number of scatterings, and the number of lights.

use std::sync::Arc;

use serde_json::json;

use super::plan::Scatterer;
use crate::scene::bounds::Bounds;
use crate::technique::optics::Optics;
use crate::technique::slab::missing;
use crate::technique::{Open, Setting, Settings};
use crate::volume::Volume;

/// The numbers of scatterings that are tried after the complete one.
const SCATTERINGS: [u32; 4] = [8, 4, 2, 1];
/// The factor by which a bound must exceed the permitted error to rule a setting out: the bound is of a slab, and the scene is not a slab.
const SLACK: f64 = 3.0;
/// The most lights that are left out.
const FAINTEST: usize = 3;

/// The technique that follows light through one scattering.
const ONCE: &str = "single_scatter";
/// The parameters that it does not have.
pub(in crate::technique) const NOT_OF_ONCE: [&str; 3] = ["max_scatterings", "next_event", "roulette_threshold"];

impl Scatterer {
    /// The part of the scattered light that is scattered more often than this view follows it, for a slab as deep as the volume is along its
    /// shallowest axis.
    pub(super) fn missing(&self, volume: &Volume, depths: [f64; 3]) -> f64 {
        let followed = if self.kernel == "single_scatter" { Some(1) } else { self.parameters.max_scatterings };
        let (Some(followed), medium) = (followed, &self.parameters.medium) else { return 0.0 };
        let density = depths.into_iter().fold(f64::INFINITY, f64::min);
        let (sigma, albedo) = (medium.sigma_t_per_unit(volume), medium.albedo.rgb());
        let of = |c: usize| missing(sigma[c] * density, albedo[c], followed);
        // Most media are grey; these need one of the three.
        let grey = (1..3).all(|c| sigma[c] == sigma[0] && albedo[c] == albedo[0]);
        (0..if grey { 1 } else { 3 }).map(of).fold(0.0, f64::max)
    }

    /// The optics of the scene, with the greatest integral of the density along each axis.
    pub(super) fn optics_of(&self, volume: &Volume, depths: [f64; 3]) -> Optics {
        let medium = &self.parameters.medium;
        let sigma = medium.sigma_t_per_unit(volume).into_iter().fold(0.0, f64::max);
        let given = self.parameters.lights.as_ref().map(|_| self.lights.shares(Bounds::from(volume).radius()));
        let shares = given.unwrap_or_default().into_iter().enumerate();
        Optics {
            optical_depth: depths.map(|d| sigma * d),
            albedo: medium.albedo.rgb().into_iter().fold(0.0, f64::max),
            anisotropy: medium.phase.mean_cosine(),
            light_shares: shares.filter_map(|(i, share)| Some((i, share?))).collect(),
        }
    }

    /// Settings with fewer scatterings, if the technique is open, and settings without the faintest lights.
    pub(super) fn settings_of(&self, volume: &Volume, depths: [f64; 3], open: &Open<'_>) -> Settings {
        let name = self.kernel;
        let words = if name == ONCE { format!("{name}, as asked") } else { format!("{name}, every scattering") };
        let mut found = Settings { all: vec![Setting::as_given(name, words)], ruled_out: Vec::new() };
        if !open.auto {
            return found;
        }
        let optics = self.optics_of(volume, depths);
        if open.leaves("max_scatterings") && optics.albedo != 0.0 {
            self.add_fewer_scatterings(&optics, open, &mut found);
        }
        let faintest = optics.faintest_lights();
        let sets = (1..=faintest.len().min(FAINTEST)).map(|n| &faintest[..n]);
        let fewer: Vec<Setting> = sets.flat_map(|set| found.all.iter().filter_map(|s| self.without(s, set))).collect();
        found.all.extend(fewer);
        found
    }

    fn add_fewer_scatterings(&self, optics: &Optics, open: &Open<'_>, found: &mut Settings) {
        let mut more = found.all[0].words.clone();
        for scatterings in SCATTERINGS {
            let (technique, words, changes) = match scatterings {
                1 => (ONCE, ONCE.to_owned(), Vec::new()),
                n => (
                    self.kernel,
                    format!("{}, at most {n} scatterings", self.kernel),
                    vec![("max_scatterings", json!(n))],
                ),
            };
            let less = vec![std::mem::replace(&mut more, words.clone())];
            if technique == ONCE && NOT_OF_ONCE.iter().any(|field| !open.leaves(field)) {
                continue;
            }
            let mut parameters = self.parameters.clone();
            parameters.max_scatterings = (technique != ONCE).then_some(scatterings);
            let Ok(view) = Self::new(technique, parameters, "") else { continue };
            let view = Some(Arc::new(view) as _);
            let setting = Setting { view, changes, unbiased: false, less, ..Setting::as_given(technique, words) };
            let bound = optics.missing(scatterings);
            if bound > SLACK * open.error {
                let why = format!("a slab as deep as this would lack {:.1} % of what it sends back", 100.0 * bound);
                found.ruled_out.push((setting, bound, why));
            } else {
                found.all.push(setting);
            }
        }
    }

    /// A setting without these lights, based on the one without one of them fewer.
    fn without(&self, setting: &Setting, faintest: &[usize]) -> Option<Setting> {
        let mut parameters = self.parameters.clone();
        let lights = parameters.lights.take()?.into_iter().enumerate();
        parameters.lights = Some(lights.filter(|(i, _)| !faintest.contains(i)).map(|(_, light)| light).collect());
        let of_setting = setting.changes.iter().find(|(field, _)| *field == "max_scatterings");
        if let Some(most) = of_setting.and_then(|(_, most)| most.as_u64()) {
            parameters.max_scatterings = Some(most as u32);
        }
        let view = Self::new(setting.technique, parameters, "").ok()?;
        let without = |words: &str, n: usize| match n {
            0 => words.to_owned(),
            1 => format!("{words}, without the faintest light"),
            n => format!("{words}, without the {n} faintest lights"),
        };
        let n = faintest.len();
        let less = setting.less.iter().map(|less| without(less, n)).chain([without(&setting.words, n - 1)]).collect();
        Some(Setting {
            view: Some(Arc::new(view)),
            without_lights: faintest.to_vec(),
            words: without(&setting.words, n),
            unbiased: false,
            less,
            ..setting.clone()
        })
    }
}
