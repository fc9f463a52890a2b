// Projections along a ray: greatest and least value, mean, sum (the line integral in world units) and X-ray (Beer and Lambert). WALKED is the exact
// walk of shared/walk.h. Without it the greatest and least value are taken on the steps of shared/packet.h, the part of a beam with the greatest
// bound first, until no part is left that could exceed them. One work-item is one beam.

#include "shared/film.h"
#include "shared/inner.h"
#include "shared/lanes.h"
#include "shared/packet.h"
#include "shared/resume.h"
#include "shared/volume.h"
#include "shared/walk.h"
#include "shared/window.h"

static inline void show(constant const View *view, constant const Projection *params, global const uchar *table, global float *film,
                        global uint *counts, const Packet *p, Real value, Mask shown) {
    film_value(view, film, counts, p, table, params->window_scale, params->window_offset, params->raw_values, value, shown);
}

#if WALKED
static inline void project(constant const View *view, constant const Projection *params, VOLUME voxels, global const uchar *table,
                           global float *film, global uint *counts, const Packet *p) {
    int peaks = params->mode == PROJECTION_PEAK;
    Walk w = walk(view, voxels, params->sign, peaks, p->ray.origin, p->ray.direction, p->ray.t_near, p->ray.t_far);
    Real value, integral = mad(w.integral, (Real)(params->slope), w.length * params->inter);
    Mask shown = MASK(w.length > 0.0f);
    if (peaks) {
        shown = MASK(w.best > -INFINITY);
        value = mad(params->sign * w.best, (Real)(params->slope), (Real)(params->inter));
    } else if (params->mode == PROJECTION_MEAN) {
        value = integral / select((Real)(1.0f), w.length, shown);
    } else if (params->mode == PROJECTION_SUM) {
        value = integral;
    } else {
        // sigma = sigma_per_value (value - zero_value), so its integral needs no walk of its own.
        value = exp(-params->sigma_per_value * (integral - params->zero_value * w.length));
        shown = (Mask)(-1); // past the volume the transmittance is 1
    }
    show(view, params, table, film, counts, p, value, shown);
}
#else
// The steps of a part of a beam, and the number of parts whose bounds are kept at a time. Shorter parts have tighter bounds and cost more of them: on
// a 256^3 picture 4 steps take a sixth longer.
#define PART 8
#define PARTS 64

// The bound of a beam's part: no sample in the steps first..last has a greater sign * raw value.
static inline float part_bound(constant const View *view, constant const Projection *params, global const uchar *ranges, const Beam *b, int first,
                               int last) {
#if INTERPOLATION == INTERPOLATION_CATMULL_ROM
    return INFINITY; // overshoots the cells' ranges
#else
    // A B-spline reads a voxel further than the cells do.
    const float wider = TAPS == 4 ? 1.0f : 0.0f;
    int from[3], to[3], count[3];
    for (int i = 0; i < 3; i++) {
        float p = b->origin[i] + b->direction[i] * ((float)first * view->step);
        float q = b->origin[i] + b->direction[i] * ((float)last * view->step);
        count[i] = (view->dims[i] + CELL - 1) / CELL;
        from[i] = clamp((int)((fmin(p, q) - b->half_width[i] - wider) * (1.0f / CELL)), 0, count[i] - 1);
        to[i] = clamp((int)((fmax(p, q) + b->half_width[i] + wider) * (1.0f / CELL)), 0, count[i] - 1);
    }
    global const Voxel *ends = (global const Voxel *)ranges + (params->sign > 0.0f ? 1 : 0);
    Voxel least = ends[2 * ((from[2] * count[1] + from[1]) * count[0] + from[0])], greatest = least;
    for (int z = from[2]; z <= to[2]; z++)
        for (int y = from[1]; y <= to[1]; y++)
            for (int x = from[0]; x <= to[0]; x++) {
                Voxel v = ends[2 * ((z * count[1] + y) * count[0] + x)];
                least = v < least ? v : least;
                greatest = v > greatest ? v : greatest;
            }
    return params->sign > 0.0f ? (float)greatest : -(float)least;
#endif
}

// Takes the steps first..last-1 of one packet, in the lanes that have a sample there.
static inline void take_steps(constant const View *view, constant const Projection *params, VOLUME voxels, const Packet *p, int first,
                              int last, Real *best) {
    for (int k = first; k < last;) {
        if (k >= p->inner && k < p->inner_end) {
            Real raw[STRIDE];
            int to = min(min(last, p->inner_end), k + STRIDE);
            whole_steps_raw(view, voxels, p, k, to, raw);
            for (int i = 0; i < to - k; i++) *best = GREATER(params->sign * INNER_UNIT * raw[i], *best);
            k = to;
        } else {
            Real t, length;
            Mask inside = edge_sample(view, p, k, &t, &length);
            if (any_lane(inside)) {
                Real v = params->sign * sample_raw(view, voxels, along(p->ray.origin, p->ray.direction, t));
                *best = select(*best, v, inside & MASK(v > *best));
            }
            k++;
        }
    }
}

// Takes the samples of the parts of a beam from step `begin` on, the part with the greatest bound first, until no part is left that could exceed the
// best values. A part is of no use to a packet unless its bound exceeds `least`.
static inline void take_parts(constant const View *view, constant const Projection *params, VOLUME voxels, global const uchar *ranges,
                              const Beam *beam, const Packet *packets, int begin, float *least, Real *best) {
    float bound[PARTS];
    int parts = min((beam->end - begin + PART - 1) / PART, PARTS);
    for (int i = 0; i < parts; i++) {
        int first = begin + i * PART;
        bound[i] = params->skipping ? part_bound(view, params, ranges, beam, first, min(first + PART, beam->end) - 1) : INFINITY;
    }
    for (int done = 0; done < parts; done++) {
        int next = 0;
        for (int i = 1; i < parts; i++) next = bound[i] > bound[next] ? i : next;
        float wanted = least[0];
        for (int i = 1; i < PACKETS; i++) wanted = fmin(wanted, least[i]);
        if (!(bound[next] > wanted)) break;
        int first = begin + next * PART, last = min(first + PART, beam->end);
        for (int i = 0; i < PACKETS; i++) {
            if (!(bound[next] > least[i])) continue;
            take_steps(view, params, voxels, &packets[i], first, last, &best[i]);
            Mask misses = MASK(!(packets[i].ray.t_far > packets[i].ray.t_near));
            least[i] = least_lane(select(best[i], (Real)(INFINITY), misses));
        }
        bound[next] = -INFINITY;
    }
}
#endif

// The state that a beam leaves to the next launch, if it is not walked. Its step is in the header.
typedef struct { Real best[PACKETS]; } BeamState;
STATE_IS(BeamState, PROJECTION_BEAM_STATE_WORDS);

kernel void projection(constant View *view, constant Projection *params, VOLUME voxels, global const uchar *ranges,
                       global const uchar *table, global float *film, global uint *counts, global uint *state) {
    int number = view->first_beam + (int)get_global_id(0);
    if (number >= beams(view)) return;
    global uint *header = resume_header(state, (uint)get_global_id(0), PROJECTION_BEAM_STATE_WORDS);
    if (view->resumed && header[0] == 0u) return;
    Packet packets[PACKETS];
    Beam beam = beam_at(view, number, INNER_MARGIN, packets);
    if (view->most_steps) header[0] = 0u;
#if WALKED
    for (int i = 0; i < PACKETS; i++) project(view, params, voxels, table, film, counts, &packets[i]);
#else
    global BeamState *saved = (global BeamState *)(header + RESUME_HEADER);
    Real best[PACKETS];
    float least[PACKETS];
    for (int i = 0; i < PACKETS; i++) {
        best[i] = view->resumed ? saved->best[i] : (Real)(-INFINITY);
        Mask misses = MASK(!(packets[i].ray.t_far > packets[i].ray.t_near));
        least[i] = least_lane(select(best[i], (Real)(INFINITY), misses));
    }
    uint left = steps_left(view->most_steps);
    int k = view->resumed ? (int)header[1] : beam.begin;
    for (; k < beam.end && left; left -= min(left, (uint)(PACKETS * PARTS * PART)), k += PARTS * PART)
        take_parts(view, params, voxels, ranges, &beam, packets, k, least, best);
    if (k < beam.end) {
        for (int i = 0; i < PACKETS; i++) saved->best[i] = best[i];
        header[1] = (uint)k;
        has_more(state, header);
        return;
    }
    for (int i = 0; i < PACKETS; i++) {
        Mask shown = MASK(best[i] > -INFINITY);
        Real value = mad(params->sign * best[i], (Real)(params->slope), (Real)(params->inter));
        show(view, params, table, film, counts, &packets[i], value, shown);
    }
#endif
}
