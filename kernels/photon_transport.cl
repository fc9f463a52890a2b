// Photons through participating media: free paths by optical depth, -ln(u) = integral of sigma ds; absorption by weight; scattering by the medium's
// phase function; refraction and reflection where the index changes; Russian roulette for small weights (it keeps the mean, an energy cut-off does
// not). One work-item carries a packet of photons; a lane whose photon has ended takes the next of the item's. On a CPU one item of each work-group
// works and has a grid of its own, since atomics take a third of the time.

#include "shared/compton.h"
#include "shared/dda.h"
#include "shared/deposit.h"
#include "shared/lanes.h"
#include "shared/medium.h"
#include "shared/passage.h"
#include "shared/phase.h"
#include "shared/photon.h"
#include "shared/queue.h"
#include "shared/resume.h"
#include "shared/rng.h"
#include "shared/tally.h"

// A step of all lanes: its end, and the medium at its start.
typedef struct {
    Mask hit, crosses, late; // at a collision, at a cell boundary, at the time gate
    Int medium;
    Real rate; // collisions per mm
    Ahead ahead;
    UInt4Lanes random;
} Step;

// Launches the next photons in the free lanes.
static inline void begin(constant const FieldPass *pass, constant const PhotonTransport *params, global const float *table, global ulong *ledger,
                         Queue *q, Photon *photon, Mask *alive, Int *steps, Gains *gains) {
    Photon launched = *photon;
    Mask missed, fresh = take_photons(*alive, q, &launched.number);
    launched.event = (UInt)(0u);
    launch(pass, params, &launched);
    launched.event = (UInt)(1u), launched.weight = (Real)(1.0f), launched.optical = launched.path = (Real)(0.0f);
    launched.scatterings = (Int)(0), launched.energy = (Real)(params->source_kev);
    enter(params, table, fresh, &launched, gains, &missed);
    gain_path(params, photon, fresh, gains);
    replace_photons(photon, &launched, fresh);
    if (any_lane(missed)) {
        gain(&gains->sums[LEDGER_LOST], photon->weight, missed);
        tally_fixed(ledger, (Int)(LEDGER_MISSED), ulong_from((UInt)(1u)), missed);
    }
#if HAS_CLEARANCE
    update_clearance(params, table, fresh, photon);
#endif
    *steps = select(*steps, (Int)(0), fresh);
    *alive |= fresh & ~missed & MASK(photon->weight > 0.0f);
}

// The medium that photons are in.
static inline Int medium_here(constant const PhotonTransport *params, global const float *table, const Photon *photon) {
#if HAS_CLEARANCE
    return photon->medium;
#else
    // Within blocks the medium matters only at collisions, unless a boundary bends light.
    if (!BLOCK_CELLS || GAMMA || params->mismatch) return medium_of(params, table, photon->cell, photon->p);
    return (Int)(0);
#endif
}

// The rate at which free paths end where photons are, per mm.
static inline Real rate_here(constant const PhotonTransport *params, global const float *table, const Photon *photon, Int medium) {
#if GAMMA
    Real rate = attenuation_at(params, table, medium, photon->energy).extinction;
#if MEDIA == MEDIA_DENSITY
    rate *= gather_reals(table + params->at_voxels, cell_voxel(params, photon->cell));
#endif
    return rate;
#else
    return collision_rate(params, table, medium, photon->cell, photon->p);
#endif
}

// Ends steps of length *t at the time gate. Returns the photons that reach it.
static inline Mask gate(constant const PhotonTransport *params, global const float *table, Int medium, Mask alive, Photon *photon, Real *t) {
    Real index = index_of(params, table, medium);
    Mask late = alive & MASK(mad(index, *t, photon->optical) > params->gate_mm);
    if (any_lane(late)) *t = select(*t, fmax((params->gate_mm - photon->optical) / index, (Real)(0.0f)), late);
    photon->optical = mad(index, *t, photon->optical);
    return late;
}

// Scores tracks of length t.
static inline void score_track(constant const PhotonTransport *params, global const float *table, Int medium, Real rate, Real t, Mask alive,
                               const Photon *photon, Grid *grid) {
#if VOXEL_CELLS
    Real amount = photon->weight * t * params->deposit_scale;
    if (params->tally == TALLY_ABSORBED_TRACK) amount *= rate * (1.0f - medium_number(params, table, medium, MEDIUM_ALBEDO));
    grid_add(grid, cell_voxel(params, photon->cell), fixed(amount), alive);
#else
    deposit_track(params, table, grid, photon->p, photon->d, t, photon->weight, alive);
#endif
}

// Takes all photons a step on: to a collision, a cell boundary or the time gate.
static inline Step advance(constant const FieldPass *pass, constant const PhotonTransport *params, global const float *table, Mask alive,
                           Photon *photon, Draws *draws, Grid *grid) {
    Step s;
    s.medium = medium_here(params, table, photon);
    s.random = draw_ahead(pass, photon, alive, draws);
    s.rate = rate_here(params, table, photon, s.medium);
    s.ahead = boundaries_ahead(params, table, photon);
    Real t_boundary = s.ahead.nearest;
#if TRACKING == TRACKING_MARCH
    // The lecture's march: a free path takes whole steps until they use up its optical depth.
    Real t = fmin(t_boundary, (Real)(params->march_step_mm));
    Mask at_boundary = MASK(t_boundary <= params->march_step_mm);
    s.hit = alive & ~at_boundary & MASK(photon->depth <= s.rate * t) & MASK(s.rate > 0.0f);
#else
    s.hit = MASK(photon->depth < s.rate * t_boundary) & alive;
    Mask at_boundary = ~s.hit;
    Real t = select(t_boundary, photon->depth * reciprocal(s.rate), s.hit);
#endif
    s.late = (Mask)(0);
    if (params->gate_mm < 1e30f) {
        s.late = gate(params, table, s.medium, alive, photon, &t);
        s.hit &= ~s.late;
    }
    if (params->tally == TALLY_FLUENCE_TRACK || params->tally == TALLY_ABSORBED_TRACK) score_track(params, table, s.medium, s.rate, t, alive, photon, grid);
    photon->p = select3(photon->p, along(photon->p, photon->d, t), alive);
    photon->path += select((Real)(0.0f), t, alive);
    photon->depth = select(photon->depth, fmax(mad(-s.rate, t, photon->depth), (Real)(0.0f)), alive & ~s.hit);
    s.crosses = alive & ~s.hit & ~s.late & at_boundary;
    return s;
}

// Scores the collisions of `real`.
static inline void score_collision(constant const PhotonTransport *params, global const float *table, const Medium *m, Real sigma, ULong absorbed,
                                   Mask real, const Photon *photon, Grid *grid) {
#if HAS_CLEARANCE
    Int voxel = cell_voxel(params, cell_within(params, photon->cell, photon->clearance, photon->p));
#else
    Int voxel = VOXEL_CELLS ? cell_voxel(params, photon->cell) : voxel_at(params, photon->p);
#endif
    ULong amount = absorbed;
    if (params->tally == TALLY_FLUENCE) amount = fixed(photon->weight * params->deposit_scale / sigma);
    if (params->tally == TALLY_GATHER) {
        Real3 to = real3(params->eye_mm[0] - photon->p.x, params->eye_mm[1] - photon->p.y, params->eye_mm[2] - photon->p.z);
        Real towards = phase_density(table, m, one_minus_cosine(photon->d, scale3(to, rsqrt(fmax(dot3(to, to), (Real)(1e-20f))))));
        amount = fixed(photon->weight * params->deposit_scale / sigma * towards);
    }
    deposit(params, grid, voxel, photon->p, amount, real);
}

// The weights that are left after the roulette, which small weights play.
static inline Real roulette(constant const FieldPass *pass, constant const PhotonTransport *params, Real left, Mask real,
                            const Photon *photon, Gains *gains) {
    Mask faint = MASK(fabs(left) < params->roulette_threshold) & real;
    if (!any_lane(faint)) return left;
    Mask survives = MASK(unit_open(draw(pass, photon, 3).a) < params->roulette_survival);
    Real gained = select((Real)(0.0f), left / params->roulette_survival, survives);
    gain(&gains->sums[LEDGER_LOST], left - gained, faint);
    return select(left, gained, faint);
}

#if BLOCK_CELLS
// The real collisions among the tentative ones `hit`; *sigma is the extinction there.
static inline Mask real_of(constant const PhotonTransport *params, global const float *table, global ulong *ledger, const Step *s, Int medium,
                           Mask hit, Photon *photon, Real *sigma) {
    *sigma = extinction_at(params, table, medium, photon->cell, photon->p);
    Mask broken = hit & MASK(*sigma > s->rate * 1.000001f);
    if (any_lane(broken)) tally_fixed(ledger, (Int)(LEDGER_BROKEN), ulong_from((UInt)(1u)), broken);
    Real factor;
    Mask real = real_collisions(*sigma, s->rate, unit_open(s->random.d), hit, &factor);
    photon->weight = select(photon->weight, photon->weight * factor, hit);
    return real;
}
#endif

// Collisions: classifies them, scores the real ones, plays the roulette, scatters. Returns the photons that go on.
static inline Mask scatter(constant const FieldPass *pass, constant const PhotonTransport *params, global const float *table, global ulong *ledger,
                           const Step *s, Photon *photon, Grid *grid, Gains *gains) {
    Mask hit = s->hit, real = hit;
#if TRACKING == TRACKING_MARCH || BLOCK_CELLS
    // The medium is that of the photon's new position.
    Int medium = medium_of(params, table, photon->cell, photon->p);
#else
    Int medium = s->medium;
#endif
    photon->depth = select(photon->depth, free_depth(s->random.c), hit);
    Medium m = medium_all(params, table, medium);
    Real sigma = s->rate, one_minus, one_plus;
#if GAMMA
    m.albedo = attenuation_at(params, table, medium, photon->energy).albedo;
    // Weight is energy: the electron's part is absorbed as well. Below the tables all of it is absorbed.
    Real kept = compton(pass, photon, photon->energy, hit, &one_minus);
    m.albedo *= select((Real)(0.0f), kept, MASK(kept * photon->energy > params->gamma_least_kev));
#endif
#if BLOCK_CELLS
    real = real_of(params, table, ledger, s, medium, hit, photon, &sigma);
    if (!any_lane(real)) {
        photon->event += as_UInt(select((Int)(0), (Int)(1), hit));
        return hit;
    }
#endif
    Real absorbed = photon->weight * (1.0f - m.albedo);
    ULong absorbed_fixed = fixed(select((Real)(0.0f), absorbed, real));
    if (params->tally != TALLY_FLUENCE_TRACK && params->tally != TALLY_ABSORBED_TRACK)
        score_collision(params, table, &m, sigma, absorbed_fixed, real, photon, grid);
    gains->sums[LEDGER_ABSORBED] = add_ulong(gains->sums[LEDGER_ABSORBED], absorbed_fixed);
    gains->scatterings += as_UInt(select((Int)(0), (Int)(1), real));
    Real left = roulette(pass, params, photon->weight - absorbed, real, photon, gains);
    photon->weight = select(photon->weight, left, real);
    Mask goes_on = real & MASK(left != 0.0f);
#if GAMMA
    one_plus = 2.0f - one_minus;
    photon->energy = select(photon->energy, photon->energy * kept, goes_on);
#else
    sample_phase(table, &m, unit_open(s->random.a), &one_minus, &one_plus);
#endif
    photon->d = select3(photon->d, rotate_direction(photon->d, one_minus, one_plus, unit_open(s->random.b)), goes_on);
    photon->scatterings += select((Int)(0), (Int)(1), goes_on);
    photon->event += as_UInt(select((Int)(0), (Int)(1), hit));
    return goes_on | (hit & ~real);
}

// Handles photons at a cell boundary or the time gate. Returns those that are gone.
static inline Mask arrive(constant const FieldPass *pass, constant const PhotonTransport *params, global const float *table, global ulong *ledger,
                          const Step *s, Photon *photon, Gains *gains) {
    Mask gone = s->late;
    if (any_lane(s->crosses)) gone |= cross(pass, params, table, ledger, gains, &s->ahead, s->crosses, photon);
    if (any_lane(s->late)) gain(&gains->sums[LEDGER_GATED], photon->weight, s->late);
    return gone;
}

// Counts photons that have taken too many steps, or whose weight is not finite. Returns them.
static inline Mask faults_of(constant const PhotonTransport *params, global ulong *ledger, Mask alive, Int steps, const Photon *photon,
                             Gains *gains) {
    Mask fault = alive & (MASK(steps > params->most_steps) | MASK(!(fabs(photon->weight) <= 1e30f)));
    if (!any_lane(fault)) return fault;
    gain(&gains->sums[LEDGER_LOST], select((Real)(0.0f), photon->weight, MASK(fabs(photon->weight) <= 1e30f)), fault);
    tally_fixed(ledger, (Int)(LEDGER_FAULTS), ulong_from((UInt)(1u)), fault);
    return fault;
}

// The state that a work-item leaves to the next launch; its queue is in the header. In the kernel the packet's state is separate variables, not one
// struct: with the sums in it, which are indexed in memory, it was 4 % slower.
typedef struct { Photon photon; Int steps; Mask alive; } PhotonState;
STATE_IS(PhotonState, PHOTON_STATE_WORDS);

static inline void save(global uint *state, global uint *header, const Queue *q, const Photon *photon, Int steps, Mask alive) {
    global PhotonState *s = (global PhotonState *)(header + RESUME_HEADER);
    s->photon = *photon, s->steps = steps, s->alive = alive;
    header[1] = q->next, header[2] = q->end, header[3] = q->more;
    has_more(state, header);
}

static inline void restore(global const uint *header, Queue *q, Photon *photon, Int *steps, Mask *alive) {
    global const PhotonState *s = (global const PhotonState *)(header + RESUME_HEADER);
    *photon = s->photon, *steps = s->steps, *alive = s->alive;
    q->next = header[1], q->end = header[2], q->more = header[3];
}

kernel void photon_transport(constant FieldPass *pass, constant PhotonTransport *params, global const float *table, global ulong *grid,
                             global ulong *ledger, global uint *state) {
    if (get_global_id(0) % pass->stride != 0) return;
    uint item = (uint)get_global_id(0) / pass->stride, left = pass->most_steps;
    if ((ulong)item * pass->per_item >= pass->count) return;
    global uint *header = resume_header(state, item, PHOTON_STATE_WORDS);
    if (pass->resumed && header[0] == 0u) return;
    int voxels = params->grid[0] * params->grid[1] * params->grid[2];
    Grid sums = grid_at(grid + (pass->own_grids ? (size_t)item * voxels : 0), pass->own_grids, voxels);
    Gains gains = no_gains();
    Queue queue = queue_of(pass, item);
    Photon photon = no_photon(params);
    Draws draws;
    draws.number = draws.event = ~(UInt)(0u);
    Int steps = (Int)(0);
    Mask alive = (Mask)(0);
    if (pass->resumed) restore(header, &queue, &photon, &steps, &alive);
    header[0] = 0u;
    for (;;) {
        if (queue.next == queue.end && queue.more) take_share(pass, ledger, &queue);
        if (queue.next < queue.end && is_launch_due(count_lanes(~alive), &queue))
            begin(pass, params, table, ledger, &queue, &photon, &alive, &steps, &gains);
        if (!any_lane(alive)) {
            if (queue.next == queue.end && !queue.more) break;
            continue;
        }
        Step step = advance(pass, params, table, alive, &photon, &draws, &sums);
        Mask gone = arrive(pass, params, table, ledger, &step, &photon, &gains), goes_on = step.hit;
        if (any_lane(step.hit)) goes_on = scatter(pass, params, table, ledger, &step, &photon, &sums, &gains);
        steps += 1, queue.passed++;
        alive &= ~gone & (goes_on | ~step.hit);
        alive &= ~faults_of(params, ledger, alive, steps, &photon, &gains);
        if (--left == 0u) break;
    }
    if (sums.own) grid_flush(&sums);
    if (left == 0u) save(state, header, &queue, &photon, steps, alive);
    else gain_path(params, &photon, (Mask)(-1), &gains);
    gains_flush(ledger, &gains);
}
