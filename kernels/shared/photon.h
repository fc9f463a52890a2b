// A packet of photons, one per lane. Positions are in mm from the box's corner.
#ifndef SHARED_PHOTON_H
#define SHARED_PHOTON_H

#include "shared/dda.h"
#include "shared/fresnel.h"
#include "shared/lanes.h"
#include "shared/medium.h"
#include "shared/phase.h"
#include "shared/rng.h"
#include "shared/tally.h"

typedef struct {
    Real3 p, d;          // d has unit length
    Cell cell;
    Int medium, clearance;   // of the cell, with HAS_CLEARANCE
    Real weight;
    Real depth;          // the rest of the free path, in optical depth
    Real optical;        // path times refractive index so far
    Real path;
    Real energy;         // of a gamma photon, keV
    UInt number, event;  // key its random numbers; the number is that in this launch
    Int scatterings;
} Photon;

static inline Photon no_photon(constant const PhotonTransport *params) {
    Photon photon;
    photon.p = photon.d = real3(0.0f, 0.0f, 0.0f);
    photon.cell.x = photon.cell.y = photon.cell.z = photon.medium = photon.clearance = photon.scatterings = (Int)(0);
    photon.weight = photon.depth = photon.optical = photon.path = (Real)(0.0f);
    photon.energy = (Real)(params->source_kev);
    photon.number = photon.event = (UInt)(0u);
    return photon;
}

#if HAS_CLEARANCE
// Reads the medium and clearance of the cells that photons have reached.
static inline void update_clearance(constant const PhotonTransport *params, global const float *table, Mask moved, Photon *photon) {
    Int clearance, medium = medium_and_clearance(params, table, photon->cell, moved, &clearance);
    photon->medium = select(photon->medium, medium, moved), photon->clearance = select(photon->clearance, clearance, moved);
}
#endif

// The counter of an event's random numbers; `what` numbers the draws of one event.
static inline UInt4Lanes counter(constant const FieldPass *pass, const Photon *photon, uint what) {
    UInt low = pass->first[0] + photon->number;
    UInt high = pass->first[1] + as_UInt(select((Int)(0), (Int)(1), MASK(low < pass->first[0])));
    UInt4Lanes ctr = {low, high, photon->event, (UInt)(0x70686f74u + what)};
    return ctr;
}

// Four numbers of a photon's next event.
static inline UInt4Lanes draw(constant const FieldPass *pass, const Photon *photon, uint what) {
    return philox(counter(pass, photon, what), pass->seed[0], pass->seed[1]);
}

// The numbers of an event and of the one after it, with the photons and events that they belong to.
typedef struct { UInt4Lanes first, second; UInt number, event; } Draws;

// Four numbers of the next event of the photons in `alive`, possibly drawn ahead.
static inline UInt4Lanes draw_ahead(constant const FieldPass *pass, const Photon *photon, Mask alive, Draws *draws) {
    if (LANES == 1) return draw(pass, photon, 0);
    UInt ahead = photon->event - draws->event;
    if (any_lane(alive & (MASK(ahead > 1u) | MASK(photon->number != draws->number)))) {
        draws->first = draws->second = counter(pass, photon, 0);
        draws->second.c += 1u;
        philox_two(&draws->first, &draws->second, pass->seed[0], pass->seed[1]);
        draws->number = photon->number, draws->event = photon->event;
        return draws->first;
    }
    Mask second = MASK(ahead == 1u);
    #define NUMBER(c) as_UInt(select(as_Int(draws->first.c), as_Int(draws->second.c), second))
    UInt4Lanes numbers = {NUMBER(a), NUMBER(b), NUMBER(c), NUMBER(d)};
    #undef NUMBER
    return numbers;
}

// Puts newly launched photons in the lanes of `fresh`.
static inline void replace_photons(Photon *photon, const Photon *launched, Mask fresh) {
    photon->p = select3(photon->p, launched->p, fresh), photon->d = select3(photon->d, launched->d, fresh);
    photon->cell.x = select(photon->cell.x, launched->cell.x, fresh), photon->cell.y = select(photon->cell.y, launched->cell.y, fresh);
    photon->cell.z = select(photon->cell.z, launched->cell.z, fresh);
    photon->weight = select(photon->weight, launched->weight, fresh), photon->depth = select(photon->depth, launched->depth, fresh);
    photon->optical = select(photon->optical, launched->optical, fresh), photon->path = select(photon->path, launched->path, fresh);
    photon->energy = select(photon->energy, launched->energy, fresh);
    photon->number = as_UInt(select(as_Int(photon->number), as_Int(launched->number), fresh));
    photon->event = as_UInt(select(as_Int(photon->event), as_Int(launched->event), fresh));
    photon->scatterings = select(photon->scatterings, launched->scatterings, fresh);
}

// Adds the paths of photons that have ended.
static inline void gain_path(constant const PhotonTransport *params, const Photon *photon, Mask ended, Gains *gains) {
    Real path = select((Real)(0.0f), fmin(photon->path * params->paths_per_mm, (Real)(1e15f)), ended);
    gains->path = add_ulong(gains->path, ulong_rounded(path));
}

// Samples the position and direction of a new photon.
static inline void launch(constant const FieldPass *pass, constant const PhotonTransport *params, Photon *photon) {
    UInt4Lanes r = draw(pass, photon, 0);
    constant const float *at = params->source, *axis = params->source_axis;
    photon->p = real3(at[0], at[1], at[2]);
    photon->d = real3(axis[0], axis[1], axis[2]);
    photon->depth = free_depth(r.c);
    Real u = unit_open(r.a), v = unit_open(r.b);
    if (params->source_type == SOURCE_ISOTROPIC || params->source_type == SOURCE_CONE) {
        Real one_minus = u * (1.0f - params->source_cos_from);
        photon->d = rotate_direction(photon->d, one_minus, 2.0f - one_minus, v);
    }
    if (params->source_type == SOURCE_DIFFUSE) {
        Real cosine = sqrt(u);
        photon->d = rotate_direction(photon->d, 1.0f - cosine, 1.0f + cosine, v);
    }
    if (params->source_type == SOURCE_PLANAR || params->source_type == SOURCE_DISK || params->source_type == SOURCE_DIFFUSE) {
        UInt4Lanes s = draw(pass, photon, 1);
        u = unit_open(s.a), v = unit_open(s.b);
        if (params->source_type != SOURCE_PLANAR) {
            Real sine, cosine, radius = sqrt(u);
            turn(v, &sine, &cosine);
            u = radius * cosine, v = radius * sine;
        }
        constant const float *a = params->source_u, *b = params->source_v;
        photon->p = real3(at[0] + u * a[0] + v * b[0], at[1] + u * a[1] + v * b[1], at[2] + u * a[2] + v * b[2]);
    }
}

// Takes a photon from its start to the box, where it is refracted and partly reflected. Photons that miss the box are `missed`.
static inline void enter(constant const PhotonTransport *params, global const float *table, Mask fresh, Photon *photon, Gains *gains,
                         Mask *missed) {
    Real near = (Real)(-1e30f), far = (Real)(1e30f);
    Int axis = (Int)(0);
    #define AXIS(i, c)                                                                                                     \
        {                                                                                                                  \
            Real d = select(photon->d.c, copysign((Real)(1e-20f), photon->d.c), MASK(fabs(photon->d.c) < 1e-20f));          \
            Real a = (params->low_mm[i] - photon->p.c) / d, b = (params->high_mm[i] - photon->p.c) / d, from = fmin(a, b); \
            axis = select(axis, (Int)(i), MASK(from > near));                                                              \
            near = fmax(near, from), far = fmin(far, fmax(a, b));                                                          \
        }
    AXIS(0, x)
    AXIS(1, y)
    AXIS(2, z)
    #undef AXIS
    *missed = fresh & (MASK(near > far) | MASK(far < 0.0f));
    Mask outside = fresh & ~*missed & MASK(near >= 0.0f);
    Real t = select((Real)(0.0f), near, outside), cos_in = (Real)(0.0f);
    photon->p = along(photon->p, photon->d, t);
    #define AXIS(i, c)                                                                                                     \
        {                                                                                                                  \
            Mask here = outside & MASK(axis == i), up = MASK(photon->d.c > 0.0f);                                          \
            photon->p.c = select(photon->p.c, select((Real)(params->high_mm[i]), (Real)(params->low_mm[i]), up), here);     \
            photon->p.c = select(photon->p.c, clamp(photon->p.c, (Real)(params->low_mm[i]), (Real)(params->high_mm[i])), fresh & ~*missed); \
            cos_in = select(cos_in, fabs(photon->d.c), here);                                                              \
        }
    AXIS(0, x)
    AXIS(1, y)
    AXIS(2, z)
    #undef AXIS
    photon->cell = cell_at(params, table, photon->p);
    if (!params->fresnel || params->source_type == SOURCE_ISOTROPIC || !any_lane(outside)) return;
    Real index = index_of(params, table, medium_of(params, table, photon->cell, photon->p)), eta = params->outside_index / index, cos_out;
    Real reflected = fresnel(cos_in, eta, &cos_out);
    reflected = select((Real)(0.0f), reflected, outside & MASK(eta != 1.0f));
    if (params->specular_entry) {
        Real lost = photon->weight * reflected;
        gain(&gains->sums[LEDGER_SPECULAR], lost, outside);
        photon->weight = select(photon->weight, photon->weight - lost, outside);
    }
    Mask bent = outside & MASK(eta != 1.0f) & MASK(reflected < 1.0f);
    #define AXIS(i, c)                                                                                                     \
        photon->d.c = select(photon->d.c, select(photon->d.c * eta, copysign(cos_out, photon->d.c), MASK(axis == i)), bent);
    AXIS(0, x)
    AXIS(1, y)
    AXIS(2, z)
    #undef AXIS
    Mask inner = bent & MASK(photon->weight > 0.0f);
    photon->d = select3(photon->d, scale3(photon->d, rsqrt(fmax(dot3(photon->d, photon->d), (Real)(1e-20f)))), inner);
}

#endif
