// Emission and absorption along a ray: I = sum_k c_k a_k prod_{j<k} (1 - a_j), a = 1 - exp(-sigma ds)
// (Max, "Optical Models for Direct Volume Rendering", IEEE TVCG 1(2), 1995). One work-item is one beam of pixels.

#include "shared/block.h"
#include "shared/camera.h"
#include "shared/film.h"
#include "shared/inner.h"
#include "shared/lanes.h"
#include "shared/optical.h"
#include "shared/packet.h"
#include "shared/pre_integrated.h"
#include "shared/radiance.h"
#include "shared/resume.h"
#include "shared/shade.h"
#include "shared/style.h"
#include "shared/volume.h"

#if STYLED
// The transfer function of value and gradient magnitude, 256 x 256 entries.
static inline Optical classify_2d(constant const EmissionAbsorption *params, global const uchar *table, Real raw, Real magnitude) {
    Mask nan = MASK(!(magnitude == magnitude && raw == raw));
    Real v = clamp(mad(raw, (Real)(params->table_scale), (Real)(params->table_offset)), (Real)(0.0f), (Real)(255.0f));
    Real g = clamp(mad(magnitude, (Real)(params->gradient_scale), (Real)(0.5f)), (Real)(0.0f), (Real)(255.0f));
    Optical o = optical(entry_at(table, to_int(select(v, (Real)(0.0f), nan)) + (to_int(select(g, (Real)(0.0f), nan)) << 8)));
    o.alpha = select(o.alpha, (Real)(0.0f), nan);
    return o;
}

static inline void styled_step(constant const View *view, constant const EmissionAbsorption *params, VOLUME voxels,
                               global const uchar *table, const Packet *p, int k, Radiance *r) {
    Real t, length, raw;
    Mask inside = edge_sample(view, p, k, &t, &length);
    if (!any_lane(inside)) return;
    Real3 at = along(p->ray.origin, p->ray.direction, t);
    Surface s = surface_at(view, params, voxels, at, ray_world(view, p->x, p->y), &raw);
    Optical o = params->gradient_scale > 0.0f ? classify_2d(params, table, raw, s.magnitude) : classify(params, table, raw, 1.0f);
    Real factor = extinction_factor(params, &s) * (length / view->step);
    o.alpha = select((Real)(0.0f), opacity_times(o.alpha, factor), inside & MASK(factor == factor));
    if (!any_lane(MASK(o.alpha > 0.0f))) return;
    o.colour = styled_colour(view, params, &s, o.colour);
    composite(params, o, r);
}
#endif

// 1 if samples are taken a stride at a time. Lit samples that are far from each other share one gather for value and gradient.
#if LANES == 1 || BACK_TO_FRONT || STYLED || PREINTEGRATED
#define IN_STRIDES 0
#elif !SHADED
#define IN_STRIDES 1
#define STRIDES_END inner_end
#elif defined(NARROW) && NARROW_GRADIENTS
#define IN_STRIDES 1
#define STRIDES_END narrow_end
#else
#define IN_STRIDES 1
#define STRIDES_END inner_end
#endif

#if IN_STRIDES
// Shades the steps from k to end - 1, whose positions in the table are known. A lit sample takes long from its gradient to its colour: the gradients
// have a loop of their own, so that the processor works on the light of several steps at once.
static inline void shade_steps(constant const View *view, constant const EmissionAbsorption *params, VOLUME voxels, global const uchar *table,
                       const Packet *p, int k, int end, Span span, int form, const Real *position, Radiance *r) {
#if SHADED
#if NARROW_GRADIENTS
    BlockOffsets offsets = block_offsets(view, p->low + p->low_pace * (float)k, p->low_pace);
#if INNER_WHOLE
    Fixed3 at = fixed3(along(p->start, p->pace, (Real)((float)k))), pace = fixed3_nearest(p->pace);
    #define NEXT at = add_fixed3(at, pace)
    #define GRADIENT(i) narrow_gradient(view, voxels, &offsets, i, inner_of(at))
#else
    #define NEXT (void)0
    #define GRADIENT(i) narrow_gradient(view, voxels, &offsets, i, along(p->start, p->pace, (Real)((float)(k + i))))
#endif
#else
    #define NEXT (void)0
    #define GRADIENT(i) inner_gradient_at(view, voxels, along(p->start, p->pace, (Real)((float)(k + i))))
#endif
    Real3 colour[STRIDE], gradient[STRIDE];
    Real weight[STRIDE];
    int lit = 0;
    for (int i = 0; i < end - k; i++, NEXT) {
        Optical o = optical_at(table, span, form, position[i]);
        weight[lit] = weight_of(params, o.alpha, r);
        if (!any_lane(MASK(weight[lit] > 0.0f))) continue;
        colour[lit] = o.colour;
        gradient[lit++] = GRADIENT(i);
    }
    #undef GRADIENT
    #undef NEXT
    for (int i = 0; i < lit; i++) add_light(shade(view, gradient[i], GRADIENT_UNIT, p->half_way, colour[i]), weight[i], r);
#else
    for (int i = 0; i < end - k; i++) composite(params, optical_at(table, span, form, position[i]), r);
#endif
}

// Takes the steps from k to end - 1, at most STRIDE, all of them whole: first the values, then their shading. In two short loops the processor works
// on several steps at once; in a long one it works on about one.
static inline void whole_steps(constant const View *view, constant const EmissionAbsorption *params, VOLUME voxels,
                               global const uchar *table, const Packet *p, int k, int end, Radiance *r) {
    Real position[STRIDE], low = (Real)(INFINITY), high = (Real)(-INFINITY);
    whole_steps_raw(view, voxels, p, k, end, position);
    for (int i = 0; i < end - k; i++) {
        position[i] = table_position(params, table, position[i], INNER_UNIT);
        low = LESSER(position[i], low), high = GREATER(position[i], high);
    }
    Span s = span_of(table, least_lane(low), greatest_lane(high));
    if (s.empty) return;
    int form = form_of(s);
    if (form == ON_PIECE) shade_steps(view, params, voxels, table, p, k, end, s, ON_PIECE, position, r);
    else if (form == ON_PIECES) shade_steps(view, params, voxels, table, p, k, end, s, ON_PIECES, position, r);
    else shade_steps(view, params, voxels, table, p, k, end, s, ON_TABLE, position, r);
}
#endif

// Takes a whole step of every lane, away from the box's faces.
static inline void inner_step(constant const View *view, constant const EmissionAbsorption *params, VOLUME voxels,
                              global const uchar *table, const Packet *p, Real k, Radiance *r) {
    Real3 at = along(p->start, p->pace, k);
#if SHADED
    Real3 g;
    Optical o = classify(params, table, inner_gradient(view, voxels, at, &g), INNER_UNIT);
    if (!any_lane(MASK(o.alpha > 0.0f))) return;
    o.colour = shade(view, g, GRADIENT_UNIT, p->half_way, o.colour);
#else
    Optical o = classify(params, table, inner_raw(view, voxels, at), INNER_UNIT);
#endif
    composite(params, o, r);
}

// Takes any step. Only its part inside the lane's ray counts, and absorbs over that length.
static inline void edge_step(constant const View *view, constant const EmissionAbsorption *params, VOLUME voxels,
                             global const uchar *table, const Packet *p, int k, Radiance *r) {
    Real t, length;
    Mask inside = edge_sample(view, p, k, &t, &length);
    if (!any_lane(inside)) return;
    Real3 at = along(p->ray.origin, p->ray.direction, t);
    Optical o = classify(params, table, sample_raw(view, voxels, at), 1.0f);
    Real part = opacity_times(o.alpha, length / view->step);
    o.alpha = select((Real)(0.0f), select(part, o.alpha, MASK(length >= view->step)), inside);
    if (!any_lane(MASK(o.alpha > 0.0f))) return;
#if SHADED
    o.colour = shade(view, gradient_raw(view, voxels, at), 1.0f, p->half_way, o.colour);
#endif
    composite(params, o, r);
}

// Takes the steps from k to end - 1 of a packet. Its radiance stays in registers meanwhile.
static inline void march(constant const View *view, constant const EmissionAbsorption *params, VOLUME voxels,
                         global const uchar *table, const Packet *p, int k, int end, Radiance *radiance) {
    Radiance r = *radiance;
#if PREINTEGRATED
    for (; k < end; k++) preintegrated_step(view, params, voxels, table, p, k, &r);
#elif STYLED
    for (; k < end; k++) styled_step(view, params, voxels, table, p, k, &r);
#endif
    while (k < end) {
#if IN_STRIDES
        if (k >= p->inner && k < p->STRIDES_END) {
            int to = min(end, p->STRIDES_END);
            whole_steps(view, params, voxels, table, p, k, to, &r);
            k = to;
            continue;
        }
#endif
        if (k >= p->inner && k < p->inner_end) {
            int to = min(end, p->inner_end);
            for (Real at = (Real)((float)k); k < to; k++, at += 1.0f) inner_step(view, params, voxels, table, p, at, &r);
        } else {
            int to = k < p->inner ? min(end, p->inner) : end;
            for (; k < to; k++) edge_step(view, params, voxels, table, p, k, &r);
        }
    }
    *radiance = r;
}

// The state that a beam leaves to the next launch. Its step and the packets that go on are in the header.
typedef struct { Radiance r[PACKETS]; } BeamState;
STATE_IS(BeamState, RADIANCE_STATE_WORDS);

static inline void save(global uint *state, global uint *header, int k, int going, const Radiance *r) {
    global BeamState *s = (global BeamState *)(header + RESUME_HEADER);
    for (int i = 0; i < PACKETS; i++) s->r[i] = r[i];
    header[1] = (uint)k, header[2] = (uint)going;
    has_more(state, header);
}

static inline void restore(global const uint *header, int *k, int *going, Radiance *r) {
    global const BeamState *s = (global const BeamState *)(header + RESUME_HEADER);
    for (int i = 0; i < PACKETS; i++) r[i] = s->r[i];
    *k = (int)header[1], *going = (int)header[2];
}

// The packets that go on at step k, a bit each.
static inline int packets_going(constant const View *view, constant const EmissionAbsorption *params, const Packet *packets, const Radiance *r, int k) {
    int going = 0;
    for (int i = 0; i < PACKETS; i++) {
        Mask on = MASK(r[i].transmittance > params->transmittance_floor) & MASK(packets[i].ray.t_far > (float)k * view->step);
        going |= any_lane(on) ? 1 << i : 0;
    }
    return going;
}

kernel void emission_absorption(constant View *view, constant EmissionAbsorption *params, VOLUME voxels,
                                global const uchar *distances, global const uchar *table, global float *film, global uint *counts,
                                global uint *state) {
    int number = view->first_beam + (int)get_global_id(0);
    if (number >= beams(view)) return;
    global uint *header = resume_header(state, (uint)get_global_id(0), RADIANCE_STATE_WORDS);
    if (view->resumed && header[0] == 0u) return;
    uint left = steps_left(view->most_steps);
    Packet packets[PACKETS];
    Radiance r[PACKETS];
    Beam beam = beam_at(view, number, INNER_MARGIN, packets);
    for (int i = 0; i < PACKETS; i++) {
        r[i].colour = real3(0.0f, 0.0f, 0.0f);
        r[i].transmittance = (Real)(1.0f);
#if SHADED
        half_ways(view, ray_world(view, packets[i].x, packets[i].y), packets[i].half_way);
#endif
    }
    int k = BACK_TO_FRONT ? beam.end - 1 : beam.begin, going = (1 << PACKETS) - 1;
    if (view->resumed) restore(header, &k, &going, r);
    if (view->most_steps) header[0] = 0u;
#if BACK_TO_FRONT
    for (; k >= beam.begin && left; left -= min(left, (uint)PACKETS), k--)
        for (int i = 0; i < PACKETS; i++) march(view, params, voxels, table, &packets[i], k, k + 1, &r[i]);
    if (k >= beam.begin) {
        save(state, header, k, going, r);
        return;
    }
#else
    for (; k < beam.end && going && left; left -= min(left, (uint)(PACKETS * STRIDE))) {
        int leap = beam_leap(view, &beam, distances, k);
        k += leap;
        if (leap > 0) continue;
        int end = min(k + STRIDE, beam.end);
        for (int i = 0; i < PACKETS; i++)
            if (going >> i & 1) march(view, params, voxels, table, &packets[i], k, end, &r[i]);
        k = end;
        going = packets_going(view, params, packets, r, k);
    }
    if (k < beam.end && going) {
        save(state, header, k, going, r);
        return;
    }
#endif
    for (int i = 0; i < PACKETS; i++) {
        Real alpha = 1.0f - r[i].transmittance;
        film_packet(view, film, counts, packets[i].column, packets[i].row, scale3(r[i].colour, (Real)(params->brightness)), alpha);
    }
}
