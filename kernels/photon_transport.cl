// Photons through participating media: free paths by optical depth, -ln(u) = integral of sigma ds; absorption by weight; scattering
// by the medium's phase function; refraction and reflection where the index changes; Russian roulette for weights that no longer
// matter (it keeps the mean, an energy cut-off does not).
// One work-item carries a packet of photons; a lane whose photon has ended takes the next of the item's. On a CPU one item of each
// work-group works and has a grid of its own, for atomics take a third of the time.

#include "shared/compton.h"
#include "shared/deposit.h"
#include "shared/lanes.h"
#include "shared/medium.h"
#include "shared/passage.h"
#include "shared/phase.h"
#include "shared/photon.h"
#include "shared/rng.h"
#include "shared/tally.h"
#include "shared/walls.h"

// Whether photons are launched into so many free lanes. A launch costs about a step of all lanes: if each fills f of them, and photons
// live n steps, then LANES / (n f) of the time goes into launches and (f - 1) / (2 LANES) is lost to free lanes, the least together
// where f^2 is 2 LANES^2 / n. So far n is LANES times the steps that have passed over the photons taken.
static inline int is_launch_due(int free, long taken, long passed) {
    return free == LANES || free * free * passed >= 2 * LANES * taken;
}

// Collisions in the lanes of `hit`: tells the real ones, deposits, plays the roulette, scatters. Returns the photons that go on.
static inline Mask collide(constant const FieldPass *pass, constant const PhotonTransport *params, global const float *table, Grid *grid,
                           global ulong *ledger, UInt4Lanes r, Real rate, Int medium, Mask hit, Photon *photon, Gains *gains) {
    photon->depth = select(photon->depth, free_depth(r.c), hit);
    Mask real = hit;
    Medium m = medium_all(params, table, medium);
    Real sigma = rate;
#if GAMMA
    m.albedo = attenuation_at(params, table, medium, photon->energy).albedo;
    // Weight is energy: what the electron gets is absorbed as well. Below the tables all of it is.
    Real one_minus, kept = compton(pass, photon, photon->energy, hit, &one_minus);
    m.albedo *= select((Real)(0.0f), kept, MASK(kept * photon->energy > params->gamma_least_kev));
#endif
#if BLOCK_WALLS
    sigma = extinction_at(params, table, medium, photon->cell, photon->p);
    Mask broken = hit & MASK(sigma > rate * 1.000001f);
    if (any_lane(broken)) tally_fixed(ledger, (Int)(LEDGER_BROKEN), ulong_from((UInt)(1u)), broken);
    Real factor;
    real = real_collisions(sigma, rate, unit_open(r.d), hit, &factor);
    photon->weight = select(photon->weight, photon->weight * factor, hit);
    if (!any_lane(real)) {
        photon->event += as_UInt(select((Int)(0), (Int)(1), hit));
        return hit;
    }
#endif
    Real absorbed = photon->weight * (1.0f - m.albedo);
    ULong absorbed_fixed = fixed(select((Real)(0.0f), absorbed, real));
    if (params->tally != TALLY_FLUENCE_TRACK && params->tally != TALLY_ABSORBED_TRACK) {
#if REACHES
        Int voxel = cell_voxel(params, cell_within(params, photon->cell, photon->reach, photon->p));
#else
        Int voxel = VOXEL_WALLS ? cell_voxel(params, photon->cell) : voxel_at(params, photon->p);
#endif
        ULong amount = absorbed_fixed;
        if (params->tally == TALLY_FLUENCE) amount = fixed(photon->weight * params->deposit_scale / sigma);
        if (params->tally == TALLY_GATHER) {
            Real3 to = real3(params->eye_mm[0] - photon->p.x, params->eye_mm[1] - photon->p.y, params->eye_mm[2] - photon->p.z);
            Real towards = phase_density(table, &m, one_minus_cosine(photon->d, scale3(to, rsqrt(fmax(dot3(to, to), (Real)(1e-20f))))));
            amount = fixed(photon->weight * params->deposit_scale / sigma * towards);
        }
        deposit(params, grid, voxel, photon->p, amount, real);
    }
    gains->sums[LEDGER_ABSORBED] = add_ulong(gains->sums[LEDGER_ABSORBED], absorbed_fixed);
    gains->scatterings += as_UInt(select((Int)(0), (Int)(1), real));
    Real left = photon->weight - absorbed;
    Mask faint = MASK(fabs(left) < params->roulette_threshold) & real;
    if (any_lane(faint)) {
        Mask survives = MASK(unit_open(draw(pass, photon, 3).a) < params->roulette_survival);
        Real gained = select((Real)(0.0f), left / params->roulette_survival, survives);
        gain(&gains->sums[LEDGER_LOST], left - gained, faint);
        left = select(left, gained, faint);
    }
    photon->weight = select(photon->weight, left, real);
    Mask goes_on = real & MASK(left != 0.0f);
#if GAMMA
    Real one_plus = 2.0f - one_minus;
    photon->energy = select(photon->energy, photon->energy * kept, goes_on);
#else
    Real one_minus, one_plus;
    sample_phase(table, &m, unit_open(r.a), &one_minus, &one_plus);
#endif
    photon->d = select3(photon->d, turned(photon->d, one_minus, one_plus, unit_open(r.b)), goes_on);
    photon->scatterings += select((Int)(0), (Int)(1), goes_on);
    photon->event += as_UInt(select((Int)(0), (Int)(1), hit));
    return goes_on | (hit & ~real);
}

// Where the share of photons ends that begins with that one.
static inline uint share_end(constant const FieldPass *pass, uint first) { return first + min(pass->count - first, pass->per_item); }

kernel void photon_transport(constant FieldPass *pass, constant PhotonTransport *params, global const float *table, global ulong *grid,
                             global ulong *ledger) {
    if (get_global_id(0) % pass->stride != 0) return;
    uint item = (uint)get_global_id(0) / pass->stride;
    if ((ulong)item * pass->per_item >= pass->count) return;
    // Photons to launch: the item's share, or one share after the other, as long as there are any, which no item has taken.
    uint next = pass->own_grids ? 0 : item * pass->per_item, end = pass->own_grids ? 0 : share_end(pass, next);
    bool more = pass->own_grids;
    int voxels = params->grid[0] * params->grid[1] * params->grid[2];
    Grid sums = grid_at(grid + (pass->own_grids ? (size_t)item * voxels : 0), pass->own_grids, voxels);

    Photon photon;
    photon.p = photon.d = real3(0.0f, 0.0f, 0.0f);
    photon.cell.x = photon.cell.y = photon.cell.z = photon.medium = photon.reach = photon.scatterings = (Int)(0);
    photon.weight = photon.depth = photon.optical = photon.path = (Real)(0.0f);
    photon.energy = (Real)(params->source_kev);
    photon.number = photon.event = (UInt)(0u);
    Draws draws;
    draws.number = draws.event = ~(UInt)(0u);
    Gains gains = no_gains();
    Int steps = (Int)(0);
    long passed = 0, taken = 0;
    Mask alive = (Mask)(0);

    for (;;) {
        if (next == end && more) {
            next = min((uint)atom_add(&ledger[pass->taken_at], (ulong)pass->per_item), pass->count);
            end = share_end(pass, next);
            more = next < end;
        }
        if (next < end && is_launch_due(count_lanes(~alive), taken, passed)) {
            // Each free lane takes the next photon, in the lanes' order.
            IntLanes free, number;
            free.v = ~alive;
            int left = (int)(end - next), given = 0;
            for (int i = 0; i < LANES; i++) number.lane[i] = given, given -= free.lane[i];
            Mask fresh = ~alive & MASK(number.v < left);
            Photon launched = photon;
            launched.number = as_UInt(number.v) + next;
            given = min(given, left), next += (uint)given, taken += given;
            launched.event = (UInt)(0u);
            launch(pass, params, &launched);
            launched.event = (UInt)(1u), launched.weight = (Real)(1.0f), launched.optical = (Real)(0.0f), launched.scatterings = (Int)(0);
            Mask missed;
            enter(params, table, fresh, &launched, &gains, &missed);
            photon.p = select3(photon.p, launched.p, fresh), photon.d = select3(photon.d, launched.d, fresh);
            photon.cell.x = select(photon.cell.x, launched.cell.x, fresh), photon.cell.y = select(photon.cell.y, launched.cell.y, fresh);
            photon.cell.z = select(photon.cell.z, launched.cell.z, fresh);
            photon.weight = select(photon.weight, launched.weight, fresh), photon.depth = select(photon.depth, launched.depth, fresh);
            photon.optical = select(photon.optical, launched.optical, fresh);
            gain_path(params, &photon, fresh, &gains);
            photon.path = select(photon.path, (Real)(0.0f), fresh);
            photon.number = as_UInt(select(as_Int(photon.number), as_Int(launched.number), fresh));
            photon.event = as_UInt(select(as_Int(photon.event), as_Int(launched.event), fresh));
            photon.scatterings = select(photon.scatterings, (Int)(0), fresh);
            photon.energy = select(photon.energy, (Real)(params->source_kev), fresh);
            if (any_lane(missed)) {
                gain(&gains.sums[LEDGER_LOST], photon.weight, missed);
                tally_fixed(ledger, (Int)(LEDGER_MISSED), ulong_from((UInt)(1u)), missed);
            }
#if REACHES
            look_around(params, table, fresh, &photon);
#endif
            steps = select(steps, (Int)(0), fresh);
            alive |= fresh & ~missed & MASK(photon.weight > 0.0f);
        }
        if (!any_lane(alive)) {
            if (next == end && !more) break;
            continue;
        }

        // Between blocks' walls the medium counts at collisions alone, where no face bends light.
        Int medium = (Int)(0);
#if REACHES
        medium = photon.medium;
#else
        if (!BLOCK_WALLS || GAMMA || params->mismatch) medium = medium_of(params, table, photon.cell, photon.p);
#endif
        UInt4Lanes random = draw_ahead(pass, &photon, alive, &draws);
        Real rate = collision_rate(params, table, medium, photon.cell, photon.p);
#if GAMMA
        rate = attenuation_at(params, table, medium, photon.energy).extinction;
#if MEDIA == MEDIA_DENSITY
        rate *= gather_reals(table + params->at_voxels, cell_voxel(params, photon.cell));
#endif
#endif
        Ahead ahead = look_ahead(params, table, &photon);
        Real t_wall = ahead.nearest;
#if TRACKING == TRACKING_MARCH
        // The lecture's march: a free path is as many whole steps as it takes to use up its optical depth.
        Real t = fmin(t_wall, (Real)(params->march_step_mm));
        Mask at_wall = MASK(t_wall <= params->march_step_mm), hit = alive & ~at_wall & MASK(photon.depth <= rate * t) & MASK(rate > 0.0f);
#else
        Mask hit = MASK(photon.depth < rate * t_wall) & alive, at_wall = ~hit;
        Real t = select(t_wall, photon.depth * reciprocal(rate), hit);
#endif
        Mask late = (Mask)(0);
        if (params->gate_mm < 1e30f) {
            Real index = index_of(params, table, medium);
            late = alive & MASK(mad(index, t, photon.optical) > params->gate_mm);
            if (any_lane(late)) {
                t = select(t, fmax((params->gate_mm - photon.optical) / index, (Real)(0.0f)), late);
                hit &= ~late;
            }
            photon.optical = mad(index, t, photon.optical);
        }
        if (params->tally == TALLY_FLUENCE_TRACK || params->tally == TALLY_ABSORBED_TRACK) {
#if VOXEL_WALLS
            Real amount = photon.weight * t * params->deposit_scale;
            if (params->tally == TALLY_ABSORBED_TRACK) amount *= rate * (1.0f - medium_number(params, table, medium, MEDIUM_ALBEDO));
            grid_add(&sums, cell_voxel(params, photon.cell), fixed(amount), alive);
#else
            deposit_track(params, table, &sums, photon.p, photon.d, t, photon.weight, alive);
#endif
        }
        photon.p = select3(photon.p, along(photon.p, photon.d, t), alive);
        photon.path += select((Real)(0.0f), t, alive);
        photon.depth = select(photon.depth, fmax(mad(-rate, t, photon.depth), (Real)(0.0f)), alive & ~hit);

        Mask crosses = alive & ~hit & ~late & at_wall, gone = late;
        if (any_lane(crosses)) gone |= cross(pass, params, table, ledger, &gains, &ahead, crosses, &photon);
        if (any_lane(late)) gain(&gains.sums[LEDGER_GATED], photon.weight, late);
        Mask goes_on = hit;
        if (any_lane(hit)) {
#if TRACKING == TRACKING_MARCH || BLOCK_WALLS
            // The medium is that of the place which the photon has come to.
            medium = medium_of(params, table, photon.cell, photon.p);
#endif
            goes_on = collide(pass, params, table, &sums, ledger, random, rate, medium, hit, &photon, &gains);
        }
        steps += 1, passed++;
        alive &= ~gone & (goes_on | ~hit);
        Mask fault = alive & (MASK(steps > params->most_steps) | MASK(!(fabs(photon.weight) <= 1e30f)));
        if (any_lane(fault)) {
            gain(&gains.sums[LEDGER_LOST], select((Real)(0.0f), photon.weight, MASK(fabs(photon.weight) <= 1e30f)), fault);
            tally_fixed(ledger, (Int)(LEDGER_FAULTS), ulong_from((UInt)(1u)), fault);
            alive &= ~fault;
        }
    }
    if (sums.own) grid_flush(&sums);
    gain_path(params, &photon, (Mask)(-1), &gains);
    gains_flush(ledger, &gains);
}
