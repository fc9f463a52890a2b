// Light that reaches the eye directly or after one scattering. From the eye a free flight finds a collision; from there a ratio flight goes to every
// light, and a free flight in a direction of the phase function to the sky. Points, spheres and quads are also sampled equiangularly: from points on
// the ray that are chosen by the angle under which they see the light (Kulla & Fajardo, "Importance Sampling Techniques for Path Tracing in
// Participating Media", EGSR 2012): t - t_light = D tan(theta), density D / ((theta_b - theta_a) (D^2 + (t - t_light)^2)). The free flight's density
// is known only on average, e = sigma exp(-sigma t); any weights that sum to 1 keep the mean. One work-item is a tile of ITEM x ITEM pixels; a lane
// that has finished its sample takes the next one.

#include "shared/camera_flight.h"
#include "shared/flight.h"
#include "shared/lanes.h"
#include "shared/light.h"
#include "shared/path_film.h"
#include "shared/phase.h"
#include "shared/places.h"
#include "shared/resume.h"
#include "shared/rng.h"
#include "shared/tile.h"
#include "shared/tracker.h"

// The task of a lane: 0 the way from the eye; 1 .. lights a light seen from the collision; then the sky; then for each light the way from the eye to
// an equiangular vertex, and from there to the light.
typedef struct {
    Flight flight;
    Int at, task;
    Real3 light;
    Real alpha;
    Real3 entry, entry_world, d; // the point at which the ray from the eye enters the volume
    Real length, t_from;         // its length in the volume, and its start
    Mask met;                    // true if it met a collision
    Real3 vertex, vertex_world;   // the point of the collision
    Real3 scattered;             // the light that leaves it
    Real density;                // the density of the phase function's direction
} Sample;

static inline void begin(constant const View *view, constant const Scattering *params, float2 place, Int column, Int row, Mask fresh, Sample *s) {
    Flight *f = &s->flight;
    CameraFlight camera = begin_camera_flight(view, params, place, column, row, fresh, f);
    s->at = select(s->at, row * view->width + column, fresh);
    s->task = select(s->task, (Int)(0), fresh);
    s->light = select3(s->light, real3((Real)(0.0f), (Real)(0.0f), (Real)(0.0f)), fresh);
    s->alpha = select(s->alpha, (Real)(1.0f), fresh);
    s->met &= ~fresh;
    s->entry = select3(s->entry, f->p, fresh);
    s->entry_world = select3(s->entry_world, world_of(params, f->p), fresh);
    s->d = select3(s->d, f->d, fresh);
    s->length = select(s->length, camera.length, fresh);
    s->t_from = select(s->t_from, camera.eye - camera.entry, fresh);
    aim(view, params, fresh, f);
}

// The density of the length t by the angle under which the light is seen. In the lanes of `choose`, first sets t to a length by that angle from the
// number u.
static inline Real by_angle(const Sample *s, const Light *l, Real u, Mask choose, Real *t) {
    Real3 middle = select3(l->position, along(along(l->position, l->u, (Real)(0.5f)), l->v, (Real)(0.5f)), MASK(l->kind == LIGHT_QUAD));
    Real3 to = minus3(middle, s->entry_world);
    Real t_light = dot3(to, s->d);
    Real3 off = minus3(to, scale3(s->d, t_light));
    Real far = fmax(sqrt(dot3(off, off)), fmax(1e-6f * s->length, (Real)(1e-20f)));
    // The angle theta_b - theta_a and the tangent of a sum of angles are written so that nothing cancels, however far away the light is.
    Real squared = mad(far, far, t_light * t_light);
    Real angle = fmax(atan2(s->length * far, mad(far, far, -t_light * (s->length - t_light))), (Real)(1e-30f)), part = u * angle;
    Real sine = sin(part), chosen = sine * squared / mad(far, cos(part), t_light * sine);
    *t = select(*t, clamp(chosen, (Real)(0.0f), s->length), choose);
    Real past = *t - t_light;
    return far / (angle * mad(far, far, past * past));
}

static inline Real by_flight(constant const Scattering *params, Real t) { return params->sigma_mean * exp(-params->sigma_mean * t); }

// The light that reaches a vertex from a light, scattered towards the eye, with the share of next-event estimation.
static inline Real3 lit(constant const Scattering *params, global const float *table, const Light *l, Real3 at, Real3 from, UInt4Lanes r,
                        LightRay *ray) {
    Medium m = phase_of(params);
    *ray = light_ray(l, at, unit_open(r.a), unit_open(r.b));
    Real density = phase_density(table, &m, one_minus_cosine(from, ray->d));
    Real share = select((Real)(1.0f), ray->density / (ray->density + density), MASK(ray->density > 0.0f));
    return scale3(ray->light, density * share);
}

// Begins flights to light `which` from the collision.
static inline Mask from_collision(constant const View *view, constant const Scattering *params, global const float *table, Mask on, Int which, Sample *s) {
    Flight *f = &s->flight;
    UInt4Lanes r = draw(view, f, 1);
    Light l = light_of(params, table, which);
    LightRay ray;
    Real3 light = times3(s->scattered, lit(params, table, &l, s->vertex_world, s->d, r, &ray));
    if (params->equiangular) {
        Real3 way = minus3(s->vertex_world, s->entry_world);
        Real t = sqrt(dot3(way, way)), mean = by_flight(params, t), angle = by_angle(s, &l, (Real)(0.5f), (Mask)(0), &t);
        light = select3(light, scale3(light, mean / (mean + angle)), MASK(l.kind != LIGHT_SUN));
    }
    on &= MASK(magnitude(light) > 0.0f);
    fly_to(s->vertex, ray.d, ray.length, light, free_depth(r.c), on, f);
    return on;
}

// Begins flights from the collision in a direction of the phase function.
static inline Mask to_sky(constant const View *view, constant const Scattering *params, global const float *table, Mask on, Sample *s) {
    Flight *f = &s->flight;
    UInt4Lanes r = draw(view, f, 1);
    Medium m = phase_of(params);
    Real one_minus, one_plus;
    sample_phase(table, &m, unit_open(r.a), &one_minus, &one_plus);
    s->density = select(s->density, phase_density(table, &m, one_minus), on);
    fly_on(s->vertex, rotate_direction(s->d, one_minus, one_plus, unit_open(r.b)), s->scattered, free_depth(r.c), on, f);
    return on;
}

// Begins flights from the eye to an equiangular vertex of light `which`; their throughput is the scattered part there at a density of 1.
static inline Mask to_equiangular(constant const View *view, constant const Scattering *params, global const float *table, Mask on, Int which, Sample *s) {
    Flight *f = &s->flight;
    UInt4Lanes r = draw(view, f, 1);
    Light l = light_of(params, table, which);
    on &= MASK(l.kind != LIGHT_SUN) & MASK(s->length > 0.0f);
    Real t = (Real)(0.0f), angle = by_angle(s, &l, unit_open(r.a), (Mask)(-1), &t);
    Real over = 1.0f / (angle + by_flight(params, t));
    Real3 each = scale3(real3((Real)(params->sigma_t[0]), (Real)(params->sigma_t[1]), (Real)(params->sigma_t[2])), over);
    fly_to(s->entry, s->d, t, by_colour(each, params->albedo), free_depth(r.b), on, f);
    return on;
}

// Begins flights from the equiangular vertex to the light.
static inline Mask from_equiangular(constant const View *view, constant const Scattering *params, VOLUME voxels, global const float *table, Mask on, Int which,
                              Sample *s) {
    Flight *f = &s->flight;
    UInt4Lanes r = draw(view, f, 1);
    Light l = light_of(params, table, which);
    LightRay ray;
    Real3 light = lit(params, table, &l, world_of(params, f->p), s->d, r, &ray);
    light = scale3(times3(light, f->throughput), f->weight * density_at(view, params, voxels, f->p));
    on &= MASK(magnitude(light) > 0.0f);
    fly_to(f->p, ray.d, ray.length, light, free_depth(r.c), on, f);
    return on;
}

// Gives the lanes of `idle` their next flight. Returns the samples that are complete.
static inline Mask advance(constant const View *view, constant const Scattering *params, VOLUME voxels, global const float *table, Mask idle, Sample *s) {
    int lights = params->lights, last = params->equiangular ? 3 * lights + 1 : lights + 1;
    Mask through = (Mask)(0), begun = (Mask)(0);
    while (any_lane(idle)) {
        s->task += select((Int)(0), (Int)(1), idle);
        s->flight.event += as_UInt(select((Int)(0), (Int)(1), idle));
        Mask ends = idle & MASK(s->task > last);
        through |= ends;
        idle &= ~ends;
        Mask collided = idle & s->met, aims = collided & MASK(s->task <= lights), skies = collided & MASK(s->task == lights + 1), starts = (Mask)(0);
        Mask angles = idle & MASK(s->task > lights + 1), flies = angles & MASK(((s->task - lights) & 1) == 0), flown = angles & ~flies;
        if (any_lane(aims)) starts |= from_collision(view, params, table, aims, clamp(s->task - 1, (Int)(0), (Int)(max(lights - 1, 0))), s);
        if (any_lane(skies) && params->lit_by_chance) starts |= to_sky(view, params, table, skies, s);
        Int which = clamp((s->task - lights - 2) >> 1, (Int)(0), (Int)(max(lights - 1, 0)));
        if (any_lane(flown)) starts |= from_equiangular(view, params, voxels, table, flown, which, s);
        if (any_lane(flies)) {
            Mask out = to_equiangular(view, params, table, flies, which, s);
            starts |= out;
            // Without a vertex the flight from it is skipped.
            s->task += select((Int)(0), (Int)(1), flies & ~out);
        }
        begun |= starts;
        idle &= ~starts;
    }
    if (any_lane(begun)) aim(view, params, begun, &s->flight);
    return through;
}

// Handles free flights that met a collision: the first one scatters, the one after it only adds emission.
static inline void collide(constant const Scattering *params, global const float *table, Mask real, Sample *s) {
    Flight *f = &s->flight;
    Mask first = real & MASK(s->task == 0);
    Real3 at = world_of(params, f->p), arrives = scale3(f->throughput, f->weight);
    Real3 origin = select3(s->vertex_world, s->entry_world, first), way = minus3(at, origin);
    if (params->discs) {
        Real3 light = met(params, table, origin, f->d, select((Real)(0.0f), s->t_from, first), sqrt(dot3(way, way)), s->density, ~first & MASK(s->density > 0.0f), 1);
        add_light(&s->light, times3(light, arrives), real);
    }
    add_light(&s->light, by_colour(arrives, params->emission), real);
    Real3 leaves = by_colour(arrives, params->albedo);
    s->vertex = select3(s->vertex, f->p, first);
    s->vertex_world = select3(s->vertex_world, at, first);
    s->scattered = select3(s->scattered, leaves, first);
    s->met |= first & MASK(magnitude(leaves) > 0.0f);
}

// Handles flights that reached their end: at a light, at a vertex, or out of the volume.
static inline void arrive(constant const Scattering *params, global const float *table, Mask over, Sample *s) {
    Flight *f = &s->flight;
    Real3 arrives = scale3(f->throughput, f->weight);
    Mask flown = MASK(s->task > params->lights + 1) & MASK(((s->task - params->lights) & 1) == 0);
    add_light(&s->light, arrives, over & f->ratio & ~flown);
    Mask out = over & ~f->ratio, first = out & MASK(s->task == 0);
    if (!any_lane(out)) return;
    if (params->discs) {
        Real3 origin = select3(s->vertex_world, s->entry_world, first);
        Real3 light = met(params, table, origin, f->d, select((Real)(0.0f), s->t_from, first), (Real)(1e30f), s->density, ~first & MASK(s->density > 0.0f), 1);
        add_light(&s->light, times3(light, arrives), out);
    }
    if (params->sky) add_light(&s->light, times3(sky_of(params, f->d), arrives), params->sky_visible ? out : out & ~first);
    if (!(params->sky && params->sky_visible)) s->alpha = select(s->alpha, 1.0f - (arrives.x + arrives.y + arrives.z) * (1.0f / 3.0f), first);
}

// The state that a tile leaves to the next launch. The pixels that it has taken are in the header.
typedef struct { Sample s; Mask alive; } TileState;
STATE_IS(TileState, SCATTERING_STATE_WORDS);

static inline void save(global uint *state, global uint *header, const Sample *s, Mask alive, int taken) {
    global TileState *t = (global TileState *)(header + RESUME_HEADER);
    t->s = *s, t->alive = alive;
    header[1] = (uint)taken;
    has_more(state, header);
}

static inline void restore(global const uint *header, Sample *s, Mask *alive, int *taken) {
    global const TileState *t = (global const TileState *)(header + RESUME_HEADER);
    *s = t->s, *alive = t->alive;
    *taken = (int)header[1];
}

kernel void single_scatter(constant View *view, constant Scattering *params, VOLUME voxels, global const uchar *ranges, global const float *table,
                           global float *film, global uint *counts, global uint *tiles, global uint *state) {
    global uint *header = resume_header(state, (uint)get_global_id(0), SCATTERING_STATE_WORDS);
    if (view->resumed && header[0] == 0u) return;
    Tile tile = tile_at(view, tiles);
    Sample s;
    Flight *f = &s.flight;
    Real zero = (Real)(0.0f);
    *f = no_flight(tile.sample);
    s.light = s.entry = s.entry_world = s.d = s.vertex = s.vertex_world = s.scattered = real3(zero, zero, zero);
    s.at = s.task = (Int)(0);
    s.alpha = s.length = s.t_from = s.density = zero;
    s.met = (Mask)(0);
    Mask alive = (Mask)(0);
    int taken = 0;
    uint steps = 0u, left = steps_left(view->most_steps);
    if (view->resumed) restore(header, &s, &alive, &taken);
    if (view->most_steps) header[0] = 0u;
    float2 place = sample_offset(view, f->sample);
    while (f->sample < tile.sample + tile.times && left) {
        if (taken < ITEM * ITEM && count_lanes(~alive) >= REFILL) {
            Int column, row;
            Mask fresh = take_pixels(view, tile, alive, &taken, &column, &row);
            if (any_lane(fresh)) begin(view, params, place, column, row, fresh, &s);
            alive |= fresh;
        }
        if (!any_lane(alive)) {
            if (taken >= ITEM * ITEM) taken = 0, place = sample_offset(view, ++f->sample);
            continue;
        }
        Mask over;
        Int face;
        UInt4Lanes r;
        steps++, left--;
        Mask real = fly(view, params, voxels, ranges, counts, alive, f, &r, &over, &face);
        if (any_lane(real)) collide(params, table, real, &s);
        if (any_lane(over)) arrive(params, table, over, &s);
        Mask cut = alive & MASK(f->event > MOST_EVENTS), done = cut;
        if (any_lane(cut)) atomic_add(&counts[COUNT_CUT], (uint)count_lanes(cut));
        Mask idle = (real | over) & ~cut;
        if (any_lane(idle)) done |= advance(view, params, voxels, table, idle, &s);
        if (any_lane(done)) {
            finish(view, params, film, counts, f->sample, s.at, done, s.light, s.alpha);
            alive &= ~done;
        }
    }
    cost(tiles, tile, steps);
    if (f->sample < tile.sample + tile.times) save(state, header, &s, alive, taken);
}
