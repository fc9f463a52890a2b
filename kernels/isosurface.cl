// Isosurfaces: the crossings of rays with given values. Rays are sampled at the ends of their steps; if the two are on different sides, the
// crossing is refined (shared/crossing.h) and lit. One work-item is one beam.
// LAYERED: several surfaces, or some that are not opaque, are composited front to back. Otherwise a packet's rays go to their
// first crossing, and all of them are refined and lit at once.

#include "shared/camera.h"
#include "shared/crossing.h"
#include "shared/film.h"
#include "shared/inner.h"
#include "shared/lanes.h"
#include "shared/packet.h"
#include "shared/resume.h"
#include "shared/shade.h"
#include "shared/volume.h"

typedef struct {
    Real ahead;          // the value at the end of the last step
    int fresh;           // true if `ahead` is not known, after a leap
#if LAYERED
    Real3 colour;
    Real transmittance;
#else
    Mask on;             // rays that have met nothing yet
    Bracket found;
#endif
} Search;

static inline Search search_start(void) {
    Real zero = (Real)(0.0f);
    Search s;
    s.ahead = zero;
    s.fresh = 1;
#if LAYERED
    s.colour = real3(zero, zero, zero);
    s.transmittance = (Real)(1.0f);
#else
    s.on = (Mask)(-1);
    s.found = bracket(zero, zero, zero, zero, zero);
#endif
    return s;
}

typedef struct { Real t, length, before, after; Mask inside; } Stretch; // a step: its start, and the values at its ends

static inline Stretch stretch_of(constant const View *view, VOLUME voxels, const Packet *p, int k, const Search *s) {
    Stretch e;
    e.t = (Real)((float)k * view->step);
    e.length = (Real)(view->step);
    if (k >= p->inner && k < p->inner_end) {
        e.inside = (Mask)(-1);
        e.before = s->fresh ? whole_step_raw(view, voxels, p, k) : s->ahead;
        e.after = whole_step_raw(view, voxels, p, k + 1);
        return e;
    }
    Real from = fmax(e.t, p->ray.t_near), to = fmin(e.t + e.length, p->ray.t_far);
    Mask continued = s->fresh ? (Mask)(0) : MASK(p->ray.t_near < e.t);
    e.inside = MASK(to > from);
    e.t = select(e.t, from, e.inside);
    e.length = select((Real)(0.0f), to - from, e.inside);
    e.before = sample_raw(view, voxels, along(p->ray.origin, p->ray.direction, e.t));
    e.before = select(e.before, s->ahead, continued);
    e.after = sample_raw(view, voxels, along(p->ray.origin, p->ray.direction, e.t + e.length));
    return e;
}

// The film's value for a surface met at t: `colour` in its light, or the distance from the eye.
static inline Real3 surface_colour(constant const View *view, constant const Isosurface *params, VOLUME voxels, const Packet *p,
                                   const Bracket *b, Real t, Mask found, Real3 colour) {
    if (params->depth) {
        Real depth = t - eye_on_ray(view, p->x, p->y);
        return real3(depth, depth, depth);
    }
    Real3 at = along(p->ray.origin, p->ray.direction, t), ray = ray_world(view, p->x, p->y);
    Real3 slope = surface_gradient(view, voxels, params->analytic, at, found);
    Real3 half_way[MAX_LIGHTS];
    half_ways(view, ray, half_way);
    Real3 lit = shade(view, slope, 1.0f, half_way, colour);
    if (params->occlusion_rays > 0) {
        Real hidden = view->ambient * occlusion(view, params, voxels, p, b, at, ray, gradient_world(view, slope), found);
        lit = real3(mad(-hidden, colour.x, lit.x), mad(-hidden, colour.y, lit.y), mad(-hidden, colour.z, lit.z));
    }
    return lit;
}

#if LAYERED
// Crosses the surfaces in both directions: ascending if the value rises, descending if it falls.
static inline void cross(constant const View *view, constant const Isosurface *params, VOLUME voxels, const Packet *p, const Stretch *e,
                         Search *s) {
    Mask rises = MASK(e->after > e->before);
    for (int i = 0; i < params->surfaces; i++) {
        int down = params->surfaces - 1 - i;
        constant const float *one = params->color + 3 * i, *other = params->color + 3 * down;
        Bracket b = bracket(e->t, e->length, e->before, e->after, select((Real)(params->isovalue[down]), (Real)(params->isovalue[i]), rises));
        Mask found = crossed(params, &b) & e->inside & MASK(s->transmittance > params->transmittance_floor);
        if (!any_lane(found)) continue;
        Real3 colour = select3(real3((Real)(other[0]), (Real)(other[1]), (Real)(other[2])), real3((Real)(one[0]), (Real)(one[1]), (Real)(one[2])), rises);
        Real t = refined(view, params, voxels, p, b, found);
        colour = surface_colour(view, params, voxels, p, &b, t, found, colour);
        Real opacity = select((Real)(params->opacity[down]), (Real)(params->opacity[i]), rises);
        Real weight = select((Real)(0.0f), s->transmittance * opacity, found);
        s->colour = real3(mad(colour.x, weight, s->colour.x), mad(colour.y, weight, s->colour.y), mad(colour.z, weight, s->colour.z));
        s->transmittance -= weight;
    }
}
#else
static inline void cross(constant const View *view, constant const Isosurface *params, VOLUME voxels, const Packet *p, const Stretch *e,
                         Search *s) {
    Bracket b = bracket(e->t, e->length, e->before, e->after, (Real)(params->isovalue[0]));
    Mask found = crossed(params, &b) & e->inside & s->on;
    if (!any_lane(found)) return;
    s->found = select_bracket(s->found, b, found);
    s->on &= ~found;
}
#endif

// Takes the steps from k to end - 1 of a packet.
static inline void seek(constant const View *view, constant const Isosurface *params, VOLUME voxels, const Packet *p, int k, int end,
                        Search *search) {
    Search s = *search;
    for (; k < end; k++) {
        Stretch e = stretch_of(view, voxels, p, k, &s);
        if (any_lane(e.inside)) cross(view, params, voxels, p, &e, &s);
        s.ahead = e.after;
        s.fresh = 0;
    }
    *search = s;
}

// True if any ray of the packet goes on at step k.
static inline int goes_on(constant const View *view, constant const Isosurface *params, const Packet *p, const Search *s, int k) {
    Mask inside = MASK(p->ray.t_far > fmax(p->ray.t_near, (Real)((float)k * view->step)));
#if LAYERED
    return any_lane(inside & MASK(s->transmittance > params->transmittance_floor));
#else
    return any_lane(inside & s->on);
#endif
}

static inline void show(constant const View *view, constant const Isosurface *params, VOLUME voxels, global float *film,
                        global uint *counts, const Packet *p, const Search *s) {
    Real3 colour = real3((Real)(0.0f), (Real)(0.0f), (Real)(0.0f));
#if LAYERED
    colour = s->colour;
    Real alpha = 1.0f - s->transmittance;
#else
    Mask found = ~s->on;
    Real alpha = select((Real)(0.0f), (Real)(1.0f), found);
    if (any_lane(found)) {
        constant const float *c = params->color;
        Real t = refined(view, params, voxels, p, s->found, found);
        Real3 lit = surface_colour(view, params, voxels, p, &s->found, t, found, real3((Real)(c[0]), (Real)(c[1]), (Real)(c[2])));
        colour = select3(colour, lit, found);
    }
#endif
    film_packet(view, film, counts, p->column, p->row, colour, alpha);
}

// The state that a beam leaves to the next launch. Its step, the packets that go on, and those whose last value is not known are in the header.
#if LAYERED
typedef struct { Real ahead; Real3 colour; Real transmittance; } PacketState;
#else
typedef struct { Real ahead; Mask on; Bracket found; } PacketState;
#endif
typedef struct { PacketState packets[PACKETS]; } BeamState;
STATE_IS(BeamState, SEARCH_STATE_WORDS);

static inline void save(global uint *state, global uint *header, int k, int going, const Search *searches) {
    global BeamState *s = (global BeamState *)(header + RESUME_HEADER);
    uint fresh = 0u;
    for (int i = 0; i < PACKETS; i++) {
        s->packets[i].ahead = searches[i].ahead;
        fresh |= searches[i].fresh ? 1u << i : 0u;
#if LAYERED
        s->packets[i].colour = searches[i].colour, s->packets[i].transmittance = searches[i].transmittance;
#else
        s->packets[i].on = searches[i].on, s->packets[i].found = searches[i].found;
#endif
    }
    header[1] = (uint)k, header[2] = (uint)going, header[3] = fresh;
    has_more(state, header);
}

static inline void restore(global const uint *header, int *k, int *going, Search *searches) {
    global const BeamState *s = (global const BeamState *)(header + RESUME_HEADER);
    for (int i = 0; i < PACKETS; i++) {
        searches[i].ahead = s->packets[i].ahead;
        searches[i].fresh = (int)(header[3] >> i & 1u);
#if LAYERED
        searches[i].colour = s->packets[i].colour, searches[i].transmittance = s->packets[i].transmittance;
#else
        searches[i].on = s->packets[i].on, searches[i].found = s->packets[i].found;
#endif
    }
    *k = (int)header[1], *going = (int)header[2];
}

kernel void isosurface(constant View *view, constant Isosurface *params, VOLUME voxels, global const uchar *distances,
                       global const uchar *table, global float *film, global uint *counts, global uint *state) {
    int number = view->first_beam + (int)get_global_id(0);
    if (number >= beams(view)) return;
    global uint *header = resume_header(state, (uint)get_global_id(0), SEARCH_STATE_WORDS);
    if (view->resumed && header[0] == 0u) return;
    uint left = steps_left(view->most_steps);
    Packet packets[PACKETS];
    Search searches[PACKETS];
    Beam beam = beam_at(view, number, INNER_MARGIN, packets);
    int k = beam.begin, going = 0;
    for (int i = 0; i < PACKETS; i++) {
        searches[i] = search_start();
        going |= goes_on(view, params, &packets[i], &searches[i], k) ? 1 << i : 0;
    }
    if (view->resumed) restore(header, &k, &going, searches);
    if (view->most_steps) header[0] = 0u;
    for (; k < beam.end && going && left; left -= min(left, (uint)(PACKETS * STRIDE))) {
        int leap = beam_leap(view, &beam, distances, k);
        if (leap > 0) {
            k += leap;
            for (int i = 0; i < PACKETS; i++) searches[i].fresh = 1;
            continue;
        }
        int end = min(k + STRIDE, beam.end);
        for (int i = 0; i < PACKETS; i++) {
            if (!(going >> i & 1)) continue;
            seek(view, params, voxels, &packets[i], k, end, &searches[i]);
            if (!goes_on(view, params, &packets[i], &searches[i], end)) going &= ~(1 << i);
        }
        k = end;
    }
    if (k < beam.end && going) {
        save(state, header, k, going, searches);
        return;
    }
    for (int i = 0; i < PACKETS; i++) show(view, params, voxels, film, counts, &packets[i], &searches[i]);
}
