// The radiative transfer equation by paths from the eye: L = sum over scatterings of throughput * (albedo phase) * light, unbiased. At each
// scattering one light is chosen and aimed at (next-event estimation, its transmittance by a ratio flight), then the path goes on in a direction of
// the phase function. The balance heuristic weighs the sky and the lights of non-zero size that it meets there. One work-item is a tile of ITEM x
// ITEM pixels; a lane whose path has ended takes the next of them.

#include "shared/camera_flight.h"
#include "shared/flight.h"
#include "shared/lanes.h"
#include "shared/light.h"
#include "shared/path_film.h"
#include "shared/phase.h"
#include "shared/places.h"
#include "shared/resume.h"
#include "shared/rng.h"
#include "shared/surface.h"
#include "shared/tile.h"
#include "shared/tracker.h"

typedef struct {
    Flight flight;
    Int at;                    // the pixel in the film
    Real3 light;               // the light that has reached the eye
    Real alpha;
    Int scatterings;
    Real density;              // the density of the path's direction, per steradian; 0 on the way from the eye
    Real t_from;               // the start of the path's flight along its way: before 0 at the eye
    Real3 from, from_world;    // the last scattering, from which the path goes on after aiming at a light
    Real3 next, throughput;
    Real next_depth;
} Path;

// Begins a path in each lane of `fresh`, at the next pixels of the tile.
static inline void begin(constant const View *view, constant const Scattering *params, float2 place, Int column, Int row, Mask fresh, Path *path,
                         Mask *done) {
    Flight *f = &path->flight;
    CameraFlight camera = begin_camera_flight(view, params, place, column, row, fresh, f);
    path->at = select(path->at, row * view->width + column, fresh);
    path->light = select3(path->light, real3((Real)(0.0f), (Real)(0.0f), (Real)(0.0f)), fresh);
    path->alpha = select(path->alpha, (Real)(1.0f), fresh);
    path->scatterings = select(path->scatterings, (Int)(0), fresh);
    path->density = select(path->density, (Real)(0.0f), fresh);
    path->t_from = select(path->t_from, camera.eye - camera.entry, fresh);
    path->from_world = select3(path->from_world, world_of(params, f->p), fresh);
    Mask enters = fresh & camera.meets & MASK(camera.entry > camera.eye);
    if (params->index != 1.0f && any_lane(enters)) {
        Mask back = cross_face(view, 1.0f / params->index, face_at(view, f->p), unit_open(camera.number), enters, &f->d);
        if (params->sky) add_light(&path->light, sky_of(params, f->d), back);
        f->throughput = select3(f->throughput, scale3(f->throughput, (Real)(1.0f / (params->index * params->index))), enters);
        *done |= back;
    }
    aim(view, params, fresh, f);
}

// Handles flights that reach a face from inside. Returns those that are reflected.
static inline Mask surface_out(constant const View *view, constant const Scattering *params, Mask out, Int face, Path *path) {
    Flight *f = &path->flight;
    Mask back = cross_face(view, params->index, face, unit_open(draw(view, f, 4).a), out, &f->d);
    // In clear glass a totally reflected path would go on for ever. So a face counts as a hundred collisions.
    f->event += as_UInt(select((Int)(0), (Int)(100), out));
    f->throughput = select3(f->throughput, scale3(f->throughput, (Real)(params->index * params->index)), out & ~back);
    return back;
}

// Adds the light of the lights that a path's flight has met, up to the length `to`.
static inline void meet(constant const Scattering *params, global const float *table, Path *path, Real to, Mask on) {
    if (!params->discs) return;
    Real3 light = met(params, table, path->from_world, path->flight.d, path->t_from, to, path->density, params->next_event ? MASK(path->density > 0.0f) : (Mask)(0), 0);
    add_light(&path->light, scale3(times3(light, path->flight.throughput), path->flight.weight), on);
}

// Scatters paths: light emitted there, a light aimed at, a direction to go on in. Returns those that have ended.
static inline Mask scatter(constant const View *view, constant const Scattering *params, global const float *table, UInt4Lanes r, Mask real,
                           Path *path, Mask *elsewhere) {
    Flight *f = &path->flight;
    Real3 at = world_of(params, f->p), way = minus3(at, path->from_world);
    meet(params, table, path, sqrt(dot3(way, way)), real);
    Real3 arrives = scale3(f->throughput, f->weight);
    add_light(&path->light, by_colour(arrives, params->emission), real);
    path->scatterings += select((Int)(0), (Int)(1), real);
    Real3 leaves = by_colour(arrives, params->albedo);
    Mask ends = real & (MASK(path->scatterings > params->max_scatterings) | MASK(magnitude(leaves) == 0.0f));
    Mask goes_on = real & ~ends;
    UInt4Lanes s = draw(view, f, 2);
    Real u = unit_open(s.d);
    Mask faint = goes_on & MASK(magnitude(leaves) < params->roulette_threshold);
    if (any_lane(faint)) {
        Real chance = magnitude(leaves) / params->roulette_threshold;
        Mask stays = MASK(u < chance);
        leaves = select3(leaves, scale3(leaves, 1.0f / chance), faint);
        u = select(u, fmin(u / chance, (Real)(0.99999994f)), faint); // uniform again for the paths that stay
        ends |= faint & ~stays;
        goes_on &= ~(faint & ~stays);
    }
    if (!any_lane(goes_on)) return ends;
    Medium m = phase_of(params);
    Real one_minus, one_plus;
    sample_phase(table, &m, unit_open(r.a), &one_minus, &one_plus);
    path->next = select3(path->next, rotate_direction(f->d, one_minus, one_plus, unit_open(r.b)), goes_on);
    path->density = select(path->density, phase_density(table, &m, one_minus), goes_on);
    path->from = select3(path->from, f->p, goes_on);
    path->from_world = select3(path->from_world, at, goes_on);
    path->throughput = select3(path->throughput, leaves, goes_on);
    path->next_depth = select(path->next_depth, f->depth, goes_on);
    path->t_from = select(path->t_from, (Real)(0.0f), goes_on);
    Mask aims = (Mask)(0);
    if (params->next_event && params->lights > 0) {
        Int which = choose_light(params, table, unit_open(s.c));
        Light l = light_of(params, table, which);
        LightRay ray = light_ray(&l, at, unit_open(s.a), unit_open(s.b));
        Real density = phase_density(table, &m, one_minus_cosine(f->d, ray.d));
        Real own = l.chance * ray.density, share = select((Real)(1.0f), own / (own + density), MASK(own > 0.0f));
        Real3 light = scale3(times3(leaves, ray.light), density * share / l.chance);
        aims = goes_on & MASK(magnitude(light) > 0.0f);
#if DENSITY == DENSITY_CONSTANT
        // The transmittance is known in closed form, without a flight.
        add_light(&path->light, times3(light, box_transmittance(view, params, f->p, ray.d, ray.length)), aims);
        aims = (Mask)(0);
#else
        fly_to(f->p, ray.d, ray.length, light, -log(u), aims, f);
#endif
    }
    fly_on(f->p, path->next, leaves, path->next_depth, goes_on & ~aims, f);
    *elsewhere |= goes_on;
    return ends;
}

// Handles flights that have reached their end or left the volume. Returns the paths that have ended.
static inline Mask arrive(constant const View *view, constant const Scattering *params, global const float *table, Mask over, Int face, Path *path,
                          Mask *elsewhere) {
    Flight *f = &path->flight;
    Mask lit = over & f->ratio, out = over & ~f->ratio;
    if (any_lane(lit)) {
        add_light(&path->light, scale3(f->throughput, f->weight), lit);
        fly_on(path->from, path->next, path->throughput, path->next_depth, lit, f);
        *elsewhere |= lit;
    }
    if (params->index != 1.0f && any_lane(out & MASK(face >= 0))) {
        Mask back = surface_out(view, params, out & MASK(face >= 0), face, path);
        *elsewhere |= back;
        out &= ~back;
    }
    if (!any_lane(out)) return out;
    meet(params, table, path, (Real)(1e30f), out);
    Mask unscattered = out & MASK(path->scatterings == 0);
    Mask seen = params->sky_visible ? out : out & ~unscattered;
    if (params->sky) add_light(&path->light, scale3(times3(sky_of(params, f->d), f->throughput), f->weight), seen);
    Real through = f->weight * (f->throughput.x + f->throughput.y + f->throughput.z) * (1.0f / 3.0f);
    if (!(params->sky && params->sky_visible)) path->alpha = select(path->alpha, 1.0f - through, unscattered);
    return out;
}

// The state that a tile leaves to the next launch. The pixels that it has taken are in the header.
typedef struct { Path path; Mask alive; } TileState;
STATE_IS(TileState, SCATTERING_STATE_WORDS);

static inline void save(global uint *state, global uint *header, const Path *path, Mask alive, int taken) {
    global TileState *t = (global TileState *)(header + RESUME_HEADER);
    t->path = *path, t->alive = alive;
    header[1] = (uint)taken;
    has_more(state, header);
}

static inline void restore(global const uint *header, Path *path, Mask *alive, int *taken) {
    global const TileState *t = (global const TileState *)(header + RESUME_HEADER);
    *path = t->path, *alive = t->alive;
    *taken = (int)header[1];
}

kernel void volume_path(constant View *view, constant Scattering *params, VOLUME voxels, global const uchar *ranges, global const float *table,
                        global float *film, global uint *counts, global uint *tiles, global uint *state) {
    global uint *header = resume_header(state, (uint)get_global_id(0), SCATTERING_STATE_WORDS);
    if (view->resumed && header[0] == 0u) return;
    Tile tile = tile_at(view, tiles);
    Path path;
    Flight *f = &path.flight;
    Real zero = (Real)(0.0f);
    *f = no_flight(tile.sample);
    path.light = path.from = path.from_world = path.next = path.throughput = real3(zero, zero, zero);
    path.at = path.scatterings = (Int)(0);
    path.alpha = path.density = path.t_from = path.next_depth = zero;
    Mask alive = (Mask)(0);
    int taken = 0;
    uint steps = 0u, left = steps_left(view->most_steps);
    if (view->resumed) restore(header, &path, &alive, &taken);
    if (view->most_steps) header[0] = 0u;
    float2 place = sample_offset(view, f->sample);
    while (f->sample < tile.sample + tile.times && left) {
        Mask done = (Mask)(0);
        if (taken < ITEM * ITEM && count_lanes(~alive) >= REFILL) {
            Int column, row;
            Mask fresh = take_pixels(view, tile, alive, &taken, &column, &row);
            if (any_lane(fresh)) begin(view, params, place, column, row, fresh, &path, &done);
            alive |= fresh;
        }
        if (!any_lane(alive)) {
            if (taken >= ITEM * ITEM) taken = 0, place = sample_offset(view, ++f->sample);
            continue;
        }
        Mask over, elsewhere = (Mask)(0);
        Int face;
        UInt4Lanes r;
        steps++, left--;
        Mask real = fly(view, params, voxels, ranges, counts, alive & ~done, f, &r, &over, &face);
        if (any_lane(real)) done |= scatter(view, params, table, r, real, &path, &elsewhere);
        if (any_lane(over)) done |= arrive(view, params, table, over, face, &path, &elsewhere);
        Mask cut = alive & ~done & MASK(f->event > MOST_EVENTS);
        if (any_lane(cut)) {
            atomic_add(&counts[COUNT_CUT], (uint)count_lanes(cut));
            done |= cut;
        }
        if (any_lane(elsewhere & ~done)) aim(view, params, elsewhere & ~done, f);
        if (any_lane(done)) {
            finish(view, params, film, counts, f->sample, path.at, done, path.light, path.alpha);
            alive &= ~done;
        }
    }
    cost(tiles, tile, steps);
    if (f->sample < tile.sample + tile.times) save(state, header, &path, alive, taken);
}
