// Gamma photons: attenuation by energy, and Compton scattering off free electrons at rest (Klein & Nishina, Z. Phys. 52, 1929).
#ifndef SHARED_COMPTON_H
#define SHARED_COMPTON_H

#include "shared/lanes.h"
#include "shared/photon.h"
#include "shared/rng.h"

#if GAMMA
#define ELECTRON_KEV 510.99895f
#define GAMMA_ROWS 512

typedef struct { Real extinction, albedo; } Attenuation; // per mm; the part that is Compton scattering

// The row of a medium at an energy. Rows are even in the logarithm of energy, from params->gamma_least_kev to the source's energy.
static inline Attenuation attenuation_at(constant const PhotonTransport *params, global const float *table, Int medium, Real energy) {
    Real x = clamp((log2(energy) - params->gamma_least_log2) * params->gamma_rows_per_log2, (Real)(0.0f), (Real)(GAMMA_ROWS - 1.001f));
    Int row = to_int(x), at = params->at_gamma + (medium * GAMMA_ROWS + row) * 2;
    Real f = x - to_real(row), e0 = gather_reals(table, at), a0 = gather_reals(table + 1, at);
    Attenuation a;
    a.extinction = mad(gather_reals(table + 2, at) - e0, f, e0), a.albedo = mad(gather_reals(table + 3, at) - a0, f, a0);
    return a;
}

// The part of its energy that a photon keeps, and 1 - cosine of its angle: by composition and rejection from
//   d sigma / d eps ~ (1 / eps + eps) (1 - eps sin^2 / (1 + eps^2)),  eps = E' / E
// (Butcher & Messel, Nucl. Phys. 20, 1960). At worst three of four tries succeed.
static inline Real compton(constant const FieldPass *pass, const Photon *photon, Real energy, Mask on, Real *one_minus) {
    Real k = energy * (1.0f / ELECTRON_KEV), least = 1.0f / mad((Real)(2.0f), k, (Real)(1.0f));
    Real a1 = -log(least), a2 = 0.5f * mad(-least, least, (Real)(1.0f)), kept = (Real)(1.0f), minus = (Real)(0.0f);
    for (uint i = 0; i < 64 && any_lane(on); i++) {
        UInt4Lanes r = draw(pass, photon, 16 + i);
        Real u = unit_open(r.b);
        Mask first = MASK(unit_open(r.a) * (a1 + a2) < a1);
        Real eps = select(sqrt(mad(1.0f - least * least, u, least * least)), exp(-a1 * u), first);
        Real t = clamp((1.0f - eps) / (k * eps), (Real)(0.0f), (Real)(2.0f)), sine2 = t * (2.0f - t);
        Mask takes = on & MASK(unit_open(r.c) < 1.0f - eps * sine2 / mad(eps, eps, (Real)(1.0f)));
        kept = select(kept, eps, takes), minus = select(minus, t, takes);
        on &= ~takes;
    }
    *one_minus = minus;
    return kept;
}
#endif

#endif
