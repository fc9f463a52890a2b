// Emission and absorption along a ray: I = sum_k c_k a_k prod_{j<k} (1 - a_j), a = 1 - exp(-sigma ds)
// (Max, "Optical Models for Direct Volume Rendering", IEEE TVCG 1(2), 1995). One work-item is one beam of pixels.

#define TABLE_SIZE 4096

typedef struct { Real3 colour; Real alpha; } Optical;

typedef struct { Real3 colour; Real transmittance; } Radiance;

// A colour is kept with 1 added to each channel: then its bits in the table are those of a float's fraction, and what is
// composited is 1 - transmittance too high.
#define CHANNEL(bits, mask) as_Real(((bits) & (mask)) | 0x3f800000)

// The transfer function at a raw value in units of `unit`, with the opacity of a whole step. An entry is two words: the opacity's
// float less its ten lowest bits, which hold the upper bits of blue, its two lowest above (an opacity is at most 1); then 16
// bits each of red and green, turned right by 25 and 9 bits.
static inline Optical classify(constant const EmissionAbsorption *params, global const uchar *table, Real raw, float unit) {
    Optical o;
    Real x = mad(raw, (Real)(params->table_scale * unit), (Real)(params->table_offset));
    x = clamp(x, (Real)(0.0f), (Real)(TABLE_SIZE - 1));
#if VOXEL == VOXEL_F32
    Mask nan = MASK(raw != raw);
    x = select(x, (Real)(0.0f), nan);
#endif
    Int word, red_green;
    gather_pairs(table, to_int(x), &word, &red_green);
    o.alpha = as_Real(word & 0x3ffffc00);
#if VOXEL == VOXEL_F32
    o.alpha = select(o.alpha, (Real)(0.0f), nan);
#endif
    Int green = as_Int(rotate(as_UInt(red_green), (UInt)(16u))), blue = as_Int(rotate(as_UInt(word), (UInt)(13u)));
    o.colour = real3(CHANNEL(red_green, 0x007fff80), CHANNEL(green, 0x007fff80), CHANNEL(blue, 0x007ff800));
    return o;
}

#if SHADED
// The colour of a sample of gradient g, in index units, under the lights.
static inline Real3 lit(constant const View *view, const Packet *p, Real3 g, Real3 colour) {
    Real3 one = real3((Real)(1.0f), (Real)(1.0f), (Real)(1.0f));
    colour = add3(colour, scale3(one, (Real)(-1.0f)));
    return add3(shade(view, gradient_world(view, g), p->half_way, colour), one);
}
#endif

// Puts a sample behind (or, back to front, before) what is there, in the lanes whose ray has not ended.
static inline void composite(constant const EmissionAbsorption *params, Optical o, Radiance *r) {
#if BACK_TO_FRONT
    r->colour = add3(scale3(r->colour, 1.0f - o.alpha), scale3(o.colour, o.alpha));
    r->transmittance *= 1.0f - o.alpha;
#else
    Real weight = select((Real)(0.0f), r->transmittance * o.alpha, MASK(r->transmittance > params->transmittance_floor));
    r->colour = real3(mad(o.colour.x, weight, r->colour.x), mad(o.colour.y, weight, r->colour.y), mad(o.colour.z, weight, r->colour.z));
    r->transmittance -= weight;
#endif
}

#if defined(NARROW) && !SHADED
// inner_step of lanes that are close together.
static inline void narrow_step(constant const View *view, constant const EmissionAbsorption *params, global const uchar *voxels,
                               global const uchar *table, const Packet *p, float k, Radiance *r) {
    int4 first = convert_int4(p->low + p->low_pace * k);
    Real raw = narrow_raw(view, voxels, along(p->start, p->pace, (Real)(k)), first);
    composite(params, classify(params, table, raw, INNER_UNIT), r);
}
#endif

// A whole step of every lane, away from the box's faces.
static inline void inner_step(constant const View *view, constant const EmissionAbsorption *params, global const uchar *voxels,
                              global const uchar *table, const Packet *p, Real k, Radiance *r) {
    Real3 at = along(p->start, p->pace, k);
#if SHADED
    Real3 g;
    Optical o = classify(params, table, inner_gradient(view, voxels, at, &g), INNER_UNIT);
    if (!any_lane(MASK(o.alpha > 0.0f))) return;
    o.colour = lit(view, p, g, o.colour);
#else
    Optical o = classify(params, table, inner_raw(view, voxels, at), INNER_UNIT);
#endif
    composite(params, o, r);
}

// Any step: only what of it is inside the lane's ray counts, and absorbs for that long.
static inline void edge_step(constant const View *view, constant const EmissionAbsorption *params, global const uchar *voxels,
                             global const uchar *table, const Packet *p, int k, Radiance *r) {
    Real t, length;
    Mask inside = edge_sample(view, p, k, &t, &length);
    if (!any_lane(inside)) return;
    Real3 at = along(p->ray.origin, p->ray.direction, t);
    Optical o = classify(params, table, sample_raw(view, voxels, at), 1.0f);
    Real part = 1.0f - exp2(log2(1.0f - o.alpha) * (length / view->step));
    o.alpha = select((Real)(0.0f), select(part, o.alpha, MASK(length >= view->step)), inside);
    if (!any_lane(MASK(o.alpha > 0.0f))) return;
#if SHADED
    o.colour = lit(view, p, gradient_raw(view, voxels, at), o.colour);
#endif
    composite(params, o, r);
}

// The steps from k to end - 1 of a packet; what it gathers stays in registers meanwhile.
static inline void march(constant const View *view, constant const EmissionAbsorption *params, global const uchar *voxels,
                         global const uchar *table, const Packet *p, int k, int end, Radiance *radiance) {
    Radiance r = *radiance;
    while (k < end) {
#if defined(NARROW) && !SHADED
        if (k >= p->inner && k < p->narrow_end) {
            int to = min(end, p->narrow_end);
            for (float at = (float)k; k < to; k++, at += 1.0f) narrow_step(view, params, voxels, table, p, at, &r);
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

kernel void emission_absorption(constant View *view, constant EmissionAbsorption *params, global const uchar *voxels,
                                global const uchar *distances, global const uchar *table, global float *film, global uint *counts) {
    int number = view->first_beam + (int)get_global_id(0);
    if (number >= beams(view)) return;
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
#if BACK_TO_FRONT
    for (int k = beam.end - 1; k >= beam.begin; k--)
        for (int i = 0; i < PACKETS; i++) march(view, params, voxels, table, &packets[i], k, k + 1, &r[i]);
#else
    int going = (1 << PACKETS) - 1;
    for (int k = beam.begin; k < beam.end && going;) {
        int leap = beam_leap(view, &beam, distances, k);
        k += leap;
        if (leap > 0) continue;
        int end = min(k + STRIDE, beam.end);
        for (int i = 0; i < PACKETS; i++)
            if (going >> i & 1) march(view, params, voxels, table, &packets[i], k, end, &r[i]);
        k = end;
        going = 0;
        for (int i = 0; i < PACKETS; i++) {
            Mask on = MASK(r[i].transmittance > params->transmittance_floor) & MASK(packets[i].ray.t_far > (float)k * view->step);
            going |= any_lane(on) ? 1 << i : 0;
        }
    }
#endif
    for (int i = 0; i < PACKETS; i++) {
        Real alpha = 1.0f - r[i].transmittance;
        Real3 c = add3(r[i].colour, real3(-alpha, -alpha, -alpha));
        film_packet(view, film, counts, packets[i].column, packets[i].row, c, alpha);
    }
}
