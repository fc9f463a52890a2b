// Trackers of flights: extinction = density * sigma_t. A free flight ends at a real collision; a ratio flight estimates the transmittance to its end
// (ratio tracking, Novak, Selle, Jarosz, SIGGRAPH Asia 2014: T = prod (1 - sigma / m) over tentative collisions; in closed form if the extinction is
// constant within a cell). DENSITY is CONSTANT, the same density everywhere, or GRID. Extinctions of three colours are tracked together by the
// greatest of them: a collision is real with the probability P = sum(w sigma) / (m sum(w)) of the light w that is left, and the colours are weighed
// by sigma / (m P) or (m - sigma) / (m (1 - P)) (Kutz, Habel, Li, Novak, "Spectral and Decomposition Tracking", SIGGRAPH 2017).
#ifndef SHARED_TRACKER_H
#define SHARED_TRACKER_H

#include "shared/dda.h"
#include "shared/flight.h"
#include "shared/lanes.h"
#include "shared/rng.h"
#include "shared/volume.h"

// The transmittance below which flights play the roulette.
#define FAINT 0.05f

#if DENSITY == DENSITY_CONSTANT
// The transmittance of each colour from p in the box along d, as far as `length` or the box's faces.
static inline Real3 box_transmittance(constant const View *view, constant const Scattering *params, Real3 p, Real3 d, Real length) {
    Real3 way = way_of(view, d);
    #define LENGTH_TO(i, c) select((select((Real)(0.0f), (Real)((float)view->dims[i]), MASK(way.c > 0.0f)) - p.c) / way.c, (Real)(1e30f), MASK(fabs(way.c) < 1e-12f))
    Real x = LENGTH_TO(0, x), y = LENGTH_TO(1, y), z = LENGTH_TO(2, z), t = LESSER(LESSER(x, y), LESSER(z, length));
    #undef LENGTH_TO
    Real tau = GREATER(t, (Real)(0.0f)) * params->majorant;
    if (!params->chromatic) {
        Real through = exp(-tau);
        return real3(through, through, through);
    }
    return real3(exp(-tau * params->colour[0]), exp(-tau * params->colour[1]), exp(-tau * params->colour[2]));
}
#endif

// The density of a raw value; NaN is empty.
static inline Real density_of(constant const Scattering *params, Real raw) {
    // Comparisons are used, since fmin and fmax take a NaN for their other argument.
    Real density = mad(raw, (Real)(params->density_scale), (Real)(params->density_offset));
    density = select(density, (Real)(params->density_most), MASK(density > params->density_most));
    return select((Real)(0.0f), density, MASK(density > 0.0f));
}

static inline Real density_at(constant const View *view, constant const Scattering *params, VOLUME voxels, Real3 p) {
#if DENSITY == DENSITY_CONSTANT
    return (Real)(params->density_box);
#else
    return density_of(params, sample_raw(view, voxels, p));
#endif
}

// The least or the greatest voxel that a sample in a macro-cell reads.
static inline Real range_end(global const uchar *ranges, Int cell, int greatest) {
    return first_voxel(gather_words(ranges, (cell * 2 + greatest) * VOXEL_BYTES));
}

// The rate at which free paths end in the cell, per length: the extinction of the greatest colour, or a majorant of it.
static inline Real rate_at(constant const View *view, constant const Scattering *params, VOLUME voxels, global const uchar *ranges, const Flight *f) {
#if DENSITY == DENSITY_CONSTANT
    return (Real)(params->majorant);
#elif TRACKING == TRACKING_EXACT
    return density_of(params, voxel_raw(view, voxels, f->cell.x, f->cell.y, f->cell.z)) * params->sigma_most;
#elif TRACKING == TRACKING_MARCH
    return density_at(view, params, voxels, f->p) * params->sigma_most;
#else
    if (params->whole) return (Real)(params->majorant);
    Int cell = (f->cell.z * params->cells[1] + f->cell.y) * params->cells[0] + f->cell.x;
    return density_of(params, range_end(ranges, cell, params->density_scale > 0.0f)) * params->majorant;
#endif
}

// Classifies tentative collisions if colours have different extinctions, the greatest being `sigma`. Returns the real ones.
static inline Mask classify_by_colour(constant const Scattering *params, Real sigma, Real rate, Real u, Mask hit, Flight *f) {
    Mask free = hit & ~f->ratio;
    Real3 s = real3(sigma * params->colour[0], sigma * params->colour[1], sigma * params->colour[2]), w = f->throughput;
    Real3 through = real3(1.0f - s.x / rate, 1.0f - s.y / rate, 1.0f - s.z / rate);
    Real sum = fabs(w.x) + fabs(w.y) + fabs(w.z), mean = mad(fabs(w.x), s.x, mad(fabs(w.y), s.y, fabs(w.z) * s.z)) / fmax(sum, (Real)(1e-30f));
    // The chance of a real collision stays below 1, even if the majorant is too small.
    Real chance = fmin(mean / rate, select((Real)(1.0f), (Real)(0.5f), MASK(sigma > rate)));
    Mask real = free & MASK(u < chance);
    Real if_real = 1.0f / (rate * chance), if_null = 1.0f / (1.0f - chance);
    Real3 by = select3(scale3(through, if_null), scale3(s, if_real), real);
    by = select3(by, through, f->ratio);
    // The weight is the greatest colour's, for the roulette.
    Real most = fmax(fabs(by.x), fmax(fabs(by.y), fabs(by.z))), inverse = 1.0f / fmax(most, (Real)(1e-30f));
    Mask lights = hit & MASK(most > 0.0f);
    f->throughput = select3(f->throughput, real3(w.x * by.x * inverse, w.y * by.y * inverse, w.z * by.z * inverse), lights);
    f->weight = select(f->weight, f->weight * most, hit);
    return real;
}

// Classifies collisions of the rate `rate` in an extinction of `sigma`. Returns the real ones.
static inline Mask classify_collisions(constant const Scattering *params, Real sigma, Real rate, Real u, Mask hit, Flight *f) {
    if (params->chromatic) return classify_by_colour(params, sigma, rate, u, hit, f);
#if !BY_MAJORANTS
    return hit;
#else
    Real factor;
    Mask real = real_collisions(sigma, rate, u, hit & ~f->ratio, &factor);
    factor = select(factor, 1.0f - sigma / rate, f->ratio);
    f->weight = select(f->weight, f->weight * factor, hit);
    return real;
#endif
}

// The boundaries of a flight's cell that are ahead of it, one per axis (DDA), and the lengths to them.
typedef struct { Real3 at, length; Real nearest; } Boundaries;

static inline Boundaries boundaries_ahead(constant const View *view, constant const Scattering *params, const Flight *f) {
    Boundaries b;
    #define AXIS(i, c)                                                                                                     \
        b.at.c = boundary_on_axis(f->cell.c, MASK(f->way.c > 0.0f), 0.0f, params->voxels_per_cell[i], (float)view->dims[i], params->cells[i]); \
        b.length.c = select(GREATER((b.at.c - f->p.c) * f->inverse.c, (Real)(0.0f)), (Real)(1e30f), MASK(fabs(f->way.c) < 1e-12f));
    AXIS(0, x)
    AXIS(1, y)
    AXIS(2, z)
    #undef AXIS
    Real nearer = LESSER(b.length.y, b.length.z);
    b.nearest = LESSER(b.length.x, nearer);
    return b;
}

// Takes the flights of `crosses` to the next cell. Returns those that leave the volume, through the face across the axis *face.
static inline Mask cross_boundary(constant const Scattering *params, const Boundaries *b, Mask crosses, Flight *f, Int *face) {
    Mask left = (Mask)(0), in_x = crosses & MASK(b->length.x == b->nearest);
    Mask in_y = crosses & ~in_x & MASK(b->length.y == b->nearest), in_z = crosses & ~in_x & ~in_y;
    #define CROSS(i, c)                                                                                                    \
        f->p.c = select(f->p.c, b->at.c, in_##c);                                                                          \
        {                                                                                                                  \
            Int next = f->cell.c + select((Int)(-1), (Int)(1), MASK(f->way.c > 0.0f));                                     \
            /* A flight that leaves keeps its cell: there is none beyond. */                                               \
            Mask out = in_##c & (MASK(next < 0) | MASK(next >= params->cells[i]));                                         \
            f->cell.c = select(f->cell.c, next, in_##c & ~out);                                                            \
            left |= out;                                                                                                   \
            *face = select(*face, (Int)(i), out);                                                                          \
        }
    CROSS(0, x)
    CROSS(1, y)
    CROSS(2, z)
    #undef CROSS
    return left;
}

#if !BY_MAJORANTS
// Attenuates ratio flights in closed form by the optical depth of a step, which is 0 for all other lanes.
static inline void attenuate(constant const Scattering *params, Real depth, Flight *f) {
    if (!params->chromatic) {
        f->weight *= exp(-depth);
        return;
    }
    // The weight is that of the colour with the least extinction; the light takes the further losses of the other colours.
    Real3 s = real3(params->colour[0], params->colour[1], params->colour[2]);
    Real least = fmin(s.x, fmin(s.y, s.z));
    f->weight *= exp(-depth * least);
    f->throughput = real3(f->throughput.x * exp(-depth * (s.x - least)), f->throughput.y * exp(-depth * (s.y - least)), f->throughput.z * exp(-depth * (s.z - least)));
}
#endif

// Handles the collisions of `hit`, whose numbers are in *r. Returns the real ones; ratio flights that lose the roulette are *over.
static inline Mask collide_at(constant const View *view, constant const Scattering *params, VOLUME voxels, global uint *counts, Real rate,
                              Mask hit, Flight *f, UInt4Lanes *r, Mask *over) {
    *r = draw(view, f, 0);
    f->depth = select(f->depth, free_depth(r->c), hit);
    f->event += as_UInt(select((Int)(0), (Int)(1), hit));
    Real u = unit_open(r->d);
#if !BY_MAJORANTS
    return classify_collisions(params, rate, rate, u, hit, f);
#else
    Real sigma = density_at(view, params, voxels, f->p) * params->sigma_most;
    Mask broken = hit & MASK(sigma > rate * 1.00001f);
    if (any_lane(broken)) atomic_add(&counts[COUNT_BROKEN], (uint)count_lanes(broken));
    Mask real = classify_collisions(params, sigma, rate, u, hit, f);
    Mask faint = hit & f->ratio & MASK(fabs(f->weight) < FAINT);
    if (any_lane(faint)) {
        Real chance = fabs(f->weight) * (1.0f / FAINT);
        Mask stays = MASK(u < chance);
        f->weight = select(f->weight, select((Real)(0.0f), copysign((Real)(FAINT), f->weight), stays), faint);
        *over |= faint & ~stays;
    }
    return real;
#endif
}

// Takes one step of every lane that is alive: to a collision, a cell boundary, or the end of its flight. Returns the real collisions of free flights,
// with numbers for the next event in *r; *over are those that reached their end or left the volume through the face *face (-1: none).
static inline Mask fly(constant const View *view, constant const Scattering *params, VOLUME voxels, global const uchar *ranges,
                       global uint *counts, Mask alive, Flight *f, UInt4Lanes *r, Mask *over, Int *face) {
    Real rate = rate_at(view, params, voxels, ranges, f);
    Boundaries b = boundaries_ahead(view, params, f);
    Real room = LESSER(b.nearest, f->left);
    Mask ends = alive & MASK(f->left <= b.nearest);
#if TRACKING == TRACKING_MARCH
    Real t = fmin(room, (Real)(params->march_step));
    Mask short_of = MASK(t < room), hit = alive & ~f->ratio & short_of & MASK(f->depth <= rate * t) & MASK(rate > 0.0f);
    ends &= ~short_of;
    Mask crosses = alive & ~hit & ~ends & ~short_of;
#else
    Mask hit = alive & MASK(f->depth < rate * room);
#if TRACKING == TRACKING_EXACT
    hit &= ~f->ratio;
#endif
    Real t = select(room, f->depth / rate, hit);
    ends &= ~hit;
    Mask crosses = alive & ~hit & ~ends;
#endif
#if !BY_MAJORANTS
    if (any_lane(alive & f->ratio)) attenuate(params, select((Real)(0.0f), rate * t, alive & f->ratio), f);
#endif
    f->p = select3(f->p, along(f->p, f->way, t), alive);
    f->left = select(f->left, f->left - t, alive);
    f->depth = select(f->depth, fmax(mad(-rate, t, f->depth), (Real)(0.0f)), alive & ~hit);
    *over = ends;
    *face = (Int)(-1);
    if (any_lane(crosses)) *over |= cross_boundary(params, &b, crosses, f, face);
    return any_lane(hit) ? collide_at(view, params, voxels, counts, rate, hit, f, r, over) : hit;
}

#endif
