// Flights of light through a volume whose values are densities: extinction = density * sigma_t. Places are in index units, lengths in
// world units. A free flight ends at a real collision; a ratio flight estimates the transmittance to its end (ratio tracking,
// Novak, Selle, Jarosz, SIGGRAPH Asia 2014: T = prod (1 - sigma / m) over tentative collisions; in closed form where the extinction
// is constant from wall to wall). DENSITY is CONSTANT, where it is the same everywhere, or GRID.
// Extinctions of three colours are tracked together by that of the greatest: a collision is real with the probability
// P = sum(w sigma) / (m sum(w)) of the light w that is left, and the colours are weighed by sigma / (m P) or (m - sigma) / (m (1 - P))
// (Kutz, Habel, Li, Novak, "Spectral and Decomposition Tracking", SIGGRAPH 2017).
#ifndef SHARED_FLIGHT_H
#define SHARED_FLIGHT_H

#include "shared/camera.h"
#include "shared/film.h"
#include "shared/lanes.h"
#include "shared/phase.h"
#include "shared/rng.h"
#include "shared/volume.h"
#include "shared/walls.h"

// A path of more collisions than this is cut and counted.
#define MOST_EVENTS 1000000u

// Transmittances below this meet the roulette.
#define FAINT 0.05f

typedef struct {
    Real3 p, d, way;     // place; direction, of unit length in the world; the same in index units per world unit
    Real3 inverse;       // 1 / way
    Cell cell;
    Real depth;          // what is left of the free path, in optical depth
    Real left;           // the length to the end of the flight
    Real3 carried;       // light, or what of it gets to the eye
    Real weight;         // what the flight makes of it
    Mask ratio;
    uint sample;         // keys the random numbers, with
    UInt number, event;  // the pixel, and what has happened on its path
} Flight;

// Four numbers of a path's next event; `what` tells the draws of one event apart.
static inline UInt4Lanes draw(constant const View *view, const Flight *f, uint what) {
    UInt4Lanes ctr = {f->number, (UInt)(f->sample), f->event, (UInt)(view->stream + 0x6c696700u + 16u * what)};
    return philox(ctr, view->seed[0], view->seed[1]);
}

static inline Medium phase_of(constant const Scattering *params) {
    Medium m;
    m.extinction = m.albedo = (Real)(1.0f);
    m.kind = (Int)((int)params->phase[0]);
    m.a = (Real)(params->phase[1]), m.b = (Real)(params->phase[2]), m.c = (Real)(params->phase[3]);
    return m;
}

static inline Real3 world_of(constant const Scattering *params, Real3 p) {
    constant const float *m = params->world_from_index;
    return real3(mad(m[0], p.x, mad(m[3], p.y, mad(m[6], p.z, (Real)(m[9])))), mad(m[1], p.x, mad(m[4], p.y, mad(m[7], p.z, (Real)(m[10])))),
                 mad(m[2], p.x, mad(m[5], p.y, mad(m[8], p.z, (Real)(m[11])))));
}

static inline Real3 by_colour(Real3 light, constant const float *colour) {
    return real3(light.x * colour[0], light.y * colour[1], light.z * colour[2]);
}

static inline Flight no_flight(uint sample) {
    Flight f;
    Real zero = (Real)(0.0f);
    f.p = f.d = f.way = f.inverse = f.carried = real3(zero, zero, zero);
    f.cell.x = f.cell.y = f.cell.z = (Int)(0);
    f.depth = f.left = f.weight = zero;
    f.ratio = (Mask)(0);
    f.sample = sample;
    f.number = f.event = (UInt)(0u);
    return f;
}

// A direction of the world in index units per world unit.
static inline Real3 way_of(constant const View *view, Real3 d) {
    constant const float *w = view->world_gradient_from_index;
    return real3(mad(w[0], d.x, mad(w[3], d.y, w[6] * d.z)), mad(w[1], d.x, mad(w[4], d.y, w[7] * d.z)), mad(w[2], d.x, mad(w[5], d.y, w[8] * d.z)));
}

// Points the lanes of `turned` along their d, from their p.
static inline void aim(constant const View *view, constant const Scattering *params, Mask turned, Flight *f) {
    Real3 way = way_of(view, f->d);
    f->way = select3(f->way, way, turned);
    f->inverse = select3(f->inverse, real3(1.0f / way.x, 1.0f / way.y, 1.0f / way.z), turned);
    f->cell.x = select(f->cell.x, cell_on_axis(f->p.x, 0.0f, params->walls_per_voxel[0], params->walls[0]), turned);
    f->cell.y = select(f->cell.y, cell_on_axis(f->p.y, 0.0f, params->walls_per_voxel[1], params->walls[1]), turned);
    f->cell.z = select(f->cell.z, cell_on_axis(f->p.z, 0.0f, params->walls_per_voxel[2], params->walls[2]), turned);
}

// Sends the lanes of `on` on from the place p in the direction d, with what they carry: freely, until they collide or leave.
static inline void fly_on(Real3 p, Real3 d, Real3 carried, Real depth, Mask on, Flight *f) {
    f->p = select3(f->p, p, on);
    f->d = select3(f->d, d, on);
    f->carried = select3(f->carried, carried, on);
    f->weight = select(f->weight, (Real)(1.0f), on);
    f->depth = select(f->depth, depth, on);
    f->left = select(f->left, (Real)(1e30f), on);
    f->ratio &= ~on;
}

// The same along a length, to see how much of it arrives.
static inline void fly_to(Real3 p, Real3 d, Real length, Real3 carried, Real depth, Mask on, Flight *f) {
    fly_on(p, d, carried, depth, on, f);
    f->left = select(f->left, length, on);
    f->ratio |= on;
}

typedef struct { Mask meets; Real eye, entry, length; UInt number; } Sight; // of the volume from the eye, and a number that is left

// Begins a flight from the eye through a pixel in each lane of `fresh`.
static inline Sight look(constant const View *view, constant const Scattering *params, float2 place, Int column, Int row, Mask fresh, Flight *f) {
    Real x = to_real(column * view->stride) + place.x, y = to_real(row * view->stride) + place.y;
    Ray ray = camera_ray(view, x, y);
    Sight s;
    s.meets = MASK(ray.t_far > ray.t_near);
    s.eye = eye_on_ray(view, x, y);
    s.entry = select(s.eye, ray.t_near, s.meets);
    s.length = select((Real)(0.0f), ray.t_far - ray.t_near, s.meets);
    f->number = as_UInt(select(as_Int(f->number), row * view->stride * view->full_width + column * view->stride, fresh));
    f->event = as_UInt(select(as_Int(f->event), (Int)(0), fresh));
    UInt4Lanes r = draw(view, f, 1);
    f->event += as_UInt(select((Int)(0), (Int)(1), fresh));
    s.number = r.b;
    Real one = (Real)(1.0f);
    fly_on(along(ray.origin, ray.direction, s.entry), ray_world(view, x, y), real3(one, one, one), free_depth(r.a), fresh, f);
    f->left = select(f->left, (Real)(0.0f), fresh & ~s.meets);
    return s;
}

#if DENSITY == DENSITY_CONSTANT
// What of each colour gets from p in the box along d, as far as `length` or the box's faces.
static inline Real3 box_transmittance(constant const View *view, constant const Scattering *params, Real3 p, Real3 d, Real length) {
    Real3 way = way_of(view, d);
    #define REACH(i, c) select((select((Real)(0.0f), (Real)((float)view->dims[i]), MASK(way.c > 0.0f)) - p.c) / way.c, (Real)(1e30f), MASK(fabs(way.c) < 1e-12f))
    Real x = REACH(0, x), y = REACH(1, y), z = REACH(2, z), t = LESSER(LESSER(x, y), LESSER(z, length));
    #undef REACH
    Real tau = GREATER(t, (Real)(0.0f)) * params->majorant;
    if (!params->chromatic) {
        Real through = exp(-tau);
        return real3(through, through, through);
    }
    return real3(exp(-tau * params->colour[0]), exp(-tau * params->colour[1]), exp(-tau * params->colour[2]));
}
#endif

// The density of a raw value; what is not a number is empty.
static inline Real density_of(constant const Scattering *params, Real raw) {
    // Comparisons, for fmin and fmax take what is not a number for their other argument.
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

// How often a free path ends in the cell, per length: the greatest colour's extinction, or a majorant of it.
static inline Real rate_at(constant const View *view, constant const Scattering *params, VOLUME voxels, global const uchar *ranges, const Flight *f) {
#if DENSITY == DENSITY_CONSTANT
    return (Real)(params->majorant);
#elif TRACKING == TRACKING_EXACT
    return density_of(params, voxel_raw(view, voxels, f->cell.x, f->cell.y, f->cell.z)) * params->sigma_most;
#elif TRACKING == TRACKING_MARCH
    return density_at(view, params, voxels, f->p) * params->sigma_most;
#else
    if (params->whole) return (Real)(params->majorant);
    Int cell = (f->cell.z * params->walls[1] + f->cell.y) * params->walls[0] + f->cell.x;
    return density_of(params, range_end(ranges, cell, params->density_scale > 0.0f)) * params->majorant;
#endif
}

// Which of the tentative collisions are real where colours have extinctions of their own, the greatest `sigma`.
static inline Mask tell_colours(constant const Scattering *params, Real sigma, Real rate, Real u, Mask hit, Flight *f) {
    Mask free = hit & ~f->ratio;
    Real3 s = real3(sigma * params->colour[0], sigma * params->colour[1], sigma * params->colour[2]), w = f->carried;
    Real3 through = real3(1.0f - s.x / rate, 1.0f - s.y / rate, 1.0f - s.z / rate);
    Real sum = fabs(w.x) + fabs(w.y) + fabs(w.z), mean = mad(fabs(w.x), s.x, mad(fabs(w.y), s.y, fabs(w.z) * s.z)) / fmax(sum, (Real)(1e-30f));
    // Where the majorant is too small, the chance of a real collision stays below 1.
    Real chance = fmin(mean / rate, select((Real)(1.0f), (Real)(0.5f), MASK(sigma > rate)));
    Mask real = free & MASK(u < chance);
    Real if_real = 1.0f / (rate * chance), if_null = 1.0f / (1.0f - chance);
    Real3 by = select3(scale3(through, if_null), scale3(s, if_real), real);
    by = select3(by, through, f->ratio);
    // The weight is the greatest colour's, for the roulette.
    Real most = fmax(fabs(by.x), fmax(fabs(by.y), fabs(by.z))), inverse = 1.0f / fmax(most, (Real)(1e-30f));
    Mask lights = hit & MASK(most > 0.0f);
    f->carried = select3(f->carried, real3(w.x * by.x * inverse, w.y * by.y * inverse, w.z * by.z * inverse), lights);
    f->weight = select(f->weight, f->weight * most, hit);
    return real;
}

// Which of the collisions by `rate` are real, where the extinction is `sigma`.
static inline Mask tell_collisions(constant const Scattering *params, Real sigma, Real rate, Real u, Mask hit, Flight *f) {
    if (params->chromatic) return tell_colours(params, sigma, rate, u, hit, f);
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

// One step of every lane that is alive: to a collision, a wall, or the end of its flight. Returns the real collisions of free flights,
// with numbers for what follows in *r; *over are those that came to their end or left the volume through the face *face (-1: not).
static inline Mask fly(constant const View *view, constant const Scattering *params, VOLUME voxels, global const uchar *ranges,
                       global uint *counts, Mask alive, Flight *f, UInt4Lanes *r, Mask *over, Int *face) {
    Real rate = rate_at(view, params, voxels, ranges, f);
    #define WALL(i, c) wall_on_axis(f->cell.c, MASK(f->way.c > 0.0f), 0.0f, params->wall_voxels[i], (float)view->dims[i], params->walls[i])
    #define REACH(c) select(GREATER((w##c - f->p.c) * f->inverse.c, (Real)(0.0f)), (Real)(1e30f), MASK(fabs(f->way.c) < 1e-12f))
    Real wx = WALL(0, x), wy = WALL(1, y), wz = WALL(2, z);
    Real tx = REACH(x), ty = REACH(y), tz = REACH(z);
    #undef WALL
    #undef REACH
    Real t_yz = LESSER(ty, tz), t_wall = LESSER(tx, t_yz), room = LESSER(t_wall, f->left);
    Mask ends = alive & MASK(f->left <= t_wall);
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
    if (any_lane(alive & f->ratio)) {
        Real tau = rate * t, at = select((Real)(0.0f), tau, alive & f->ratio);
        if (params->chromatic) {
            // The greatest colour's weight is the least: the others are carried.
            Real3 s = real3(params->colour[0], params->colour[1], params->colour[2]);
            Real least = fmin(s.x, fmin(s.y, s.z));
            f->weight *= exp(-at * least);
            f->carried = real3(f->carried.x * exp(-at * (s.x - least)), f->carried.y * exp(-at * (s.y - least)), f->carried.z * exp(-at * (s.z - least)));
        } else {
            f->weight *= exp(-at);
        }
    }
#endif
    f->p = select3(f->p, along(f->p, f->way, t), alive);
    f->left = select(f->left, f->left - t, alive);
    f->depth = select(f->depth, fmax(mad(-rate, t, f->depth), (Real)(0.0f)), alive & ~hit);
    *over = ends;
    *face = (Int)(-1);
    if (any_lane(crosses)) {
        Mask in_x = crosses & MASK(tx == t_wall), in_y = crosses & ~in_x & MASK(ty == t_wall), in_z = crosses & ~in_x & ~in_y;
        #define CROSS(i, c)                                                                                                \
            f->p.c = select(f->p.c, w##c, in_##c);                                                                         \
            {                                                                                                              \
                Int next = f->cell.c + select((Int)(-1), (Int)(1), MASK(f->way.c > 0.0f));                                 \
                /* A flight that leaves stays in its cell: there are none beyond to look at. */                            \
                Mask out = in_##c & (MASK(next < 0) | MASK(next >= params->walls[i]));                                     \
                f->cell.c = select(f->cell.c, next, in_##c & ~out);                                                        \
                *over |= out;                                                                                              \
                *face = select(*face, (Int)(i), out);                                                                      \
            }
        CROSS(0, x)
        CROSS(1, y)
        CROSS(2, z)
        #undef CROSS
    }
    if (!any_lane(hit)) return hit;
    *r = draw(view, f, 0);
    f->depth = select(f->depth, free_depth(r->c), hit);
    f->event += as_UInt(select((Int)(0), (Int)(1), hit));
    Real u = unit_open(r->d);
#if !BY_MAJORANTS
    return tell_collisions(params, rate, rate, u, hit, f);
#else
    Real sigma = density_at(view, params, voxels, f->p) * params->sigma_most;
    Mask broken = hit & MASK(sigma > rate * 1.00001f);
    if (any_lane(broken)) atomic_add(&counts[COUNT_BROKEN], (uint)count_lanes(broken));
    Mask real = tell_collisions(params, sigma, rate, u, hit, f);
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

// A sample is a firefly if it brings more than twice the light of all that its pixel has had before.
#define FIREFLY_FROM 16
static inline int firefly(global const float *film, int pixel, int samples, float4 colour) {
    float mean = luminance(vload4(pixel, film));
    return mean > 0.0f && luminance(colour) > 2.0f * (float)samples * mean;
}

// The film's part of the paths in `done`: the next sample of their pixels.
static inline void finish(constant const View *view, constant const Scattering *params, global float *film, global uint *counts, uint sample,
                          Int at, Mask done, Real3 light, Real alpha) {
    RealLanes red, green, blue, opacity;
    IntLanes pixel, on;
    if (params->clamp_luminance > 0.0f) {
        Real y = mad((Real)(0.2126f), light.x, mad((Real)(0.7152f), light.y, 0.0722f * light.z));
        Mask bright = done & MASK(y > params->clamp_luminance);
        if (any_lane(bright)) {
            atomic_add(&counts[COUNT_CLAMPED], (uint)count_lanes(bright));
            RealLanes taken;
            taken.v = select((Real)(0.0f), fmin(y / params->clamp_luminance - 1.0f, (Real)(1e9f)), bright);
            for (int i = 0; i < LANES; i++)
                if (taken.lane[i] > 0.0f) atom_add((global ulong *)(counts + COUNT_CLAMPED_ENERGY_LOW), (ulong)(taken.lane[i] * 65536.0f));
            light = select3(light, scale3(light, params->clamp_luminance / y), bright);
        }
    }
    red.v = light.x, green.v = light.y, blue.v = light.z, opacity.v = alpha;
    pixel.v = at, on.v = done;
    int pixels = view->width * view->height;
    for (int i = 0; i < LANES; i++) {
        if (!on.lane[i]) continue;
        float4 colour = (float4)(red.lane[i], green.lane[i], blue.lane[i], opacity.lane[i]);
        if (sample >= FIREFLY_FROM && firefly(film, pixel.lane[i], (int)sample, colour)) atomic_inc(&counts[COUNT_FIREFLIES]);
        film_add(film, counts, pixel.lane[i], pixels, (int)sample, colour);
    }
}

#endif
