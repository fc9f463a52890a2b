//! Gamma photons in a scene: the kernel's table of their media, and the rules for their parameters.

use super::attenuation::{LEAST_KEV, ROWS};
use super::geometry::{Geometry, Where};
use super::medium::Medium;
use super::parameters::Parameters;
use super::tracking::Tracking;
use crate::error::{Error, Result};

/// Extinction and albedo of every medium, at even spacing in the logarithm of the energy up to the source's.
pub fn rows(media: &[Medium], source_kev: f64) -> Vec<f32> {
    let energy = |row: usize| LEAST_KEV * (source_kev / LEAST_KEV).powf(row as f64 / (ROWS - 1) as f64);
    let of = |m: &Medium, row: usize| m.attenuation.as_ref().map_or((0.0, 0.0), |a| a.at(energy(row)));
    media
        .iter()
        .flat_map(|m| (0..ROWS).map(move |row| of(m, row)))
        .flat_map(|(mu, albedo)| [mu as f32, albedo as f32])
        .collect()
}

/// Checks that all media are gamma media, and that each is complete.
///
/// # Errors
/// [`Error::Invalid`] for media of both kinds, missing attenuation, or a tracker with majorants.
pub fn check(p: &Parameters, geometry: &Geometry, tracking: Tracking, at: &str) -> Result<()> {
    for (i, medium) in geometry.media.iter().enumerate() {
        let place = match geometry.place {
            Where::Layers(_) => format!("{at}/layers/{i}"),
            Where::Labels { .. } => format!("{at}/media/{i}"),
            _ => format!("{at}/medium"),
        };
        let compton = medium.phase.kind == "klein_nishina";
        if compton != geometry.is_gamma() {
            let permitted = "klein_nishina for all media or for none";
            return Err(Error::invalid(format!("{place}/phase/type"), "gamma photons beside light", permitted));
        }
        match &medium.attenuation {
            Some(attenuation) if compton => attenuation.check(&format!("{place}/attenuation"))?,
            None if !compton => {}
            Some(_) => {
                let permitted = "leave it out, or the phase klein_nishina";
                return Err(Error::invalid(format!("{place}/attenuation"), "only for gamma photons", permitted));
            }
            None => {
                let permitted = "a material, or a table";
                return Err(Error::invalid(format!("{place}/attenuation"), "klein_nishina needs it", permitted));
            }
        }
    }
    if geometry.is_gamma() && tracking != Tracking::Exact {
        let detail = "the extinction of gamma photons changes with their energy, so there is no one majorant or step";
        return Err(Error::invalid(format!("{at}/tracking"), detail, "auto or exact"));
    }
    if geometry.is_gamma() && p.tally == "radiance_gather" {
        return Err(Error::invalid(format!("{at}/tally"), "the gather is of light", "fluence or absorbed"));
    }
    if geometry.is_gamma() && p.tally == "absorbed" && p.estimator.as_deref() == Some("track_length") {
        let permitted = "collision, or leave it out";
        return Err(Error::invalid(
            format!("{at}/estimator"),
            "what gamma photons leave depends on their angle",
            permitted,
        ));
    }
    if !geometry.is_gamma() && p.source.energy_kev.is_some() {
        let permitted = "leave it out, or media with the phase klein_nishina";
        return Err(Error::invalid(format!("{at}/source/energy_kev"), "only for gamma photons", permitted));
    }
    Ok(())
}
