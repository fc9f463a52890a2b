// Emission and absorption along a ray: I = sum_k c_k a_k prod_{j<k} (1 - a_j), a = 1 - exp(-sigma ds)
// (Max, "Optical Models for Direct Volume Rendering", IEEE TVCG 1(2), 1995). One work-item is one beam of pixels.

#define TABLE_SIZE 4096

typedef struct { Real3 colour; Real alpha; } Optical;

typedef struct { Real3 colour; Real transmittance; } Radiance;

// The transfer function at a raw value, with the opacity of a whole step. An entry is two words: the opacity's float less its
// ten lowest bits, which with the two highest (an opacity is at most 1) hold the square root of blue; then red and green.
static inline Optical classify(constant const EmissionAbsorption *params, global const uchar *table, Real raw) {
    Optical o;
    Real x = clamp(mad(raw, (Real)(params->table_scale), (Real)(params->table_offset)), (Real)(0.0f), (Real)(TABLE_SIZE - 1));
#if VOXEL == VOXEL_F32
    Mask nan = MASK(raw != raw);
    x = select(x, (Real)(0.0f), nan);
#endif
    Int entry = to_int(x) << 3;
    Int word = gather_words(table, entry), red_green = gather_words(table + 4, entry);
    o.alpha = as_Real(word & 0x3ffffc00);
#if VOXEL == VOXEL_F32
    o.alpha = select(o.alpha, (Real)(0.0f), nan);
#endif
    Real root = to_real(as_Int(rotate(as_UInt(word), (UInt)(2u))) & 0xfff) * (1.0f / 4095.0f);
    o.colour = real3(to_real(red_green & 0xffff) * (1.0f / 65535.0f), to_real(as_Int(as_UInt(red_green) >> 16)) * (1.0f / 65535.0f),
                     root * root);
    return o;
}

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

// A whole step of every lane, away from the box's faces.
static inline void inner_step(constant const View *view, constant const EmissionAbsorption *params, global const uchar *voxels,
                              global const uchar *table, const Packet *p, float t, Radiance *r) {
    Real3 at = along(p->start, p->ray.direction, (Real)(t));
#if SHADED
    Real3 g;
    Optical o = classify(params, table, inner_gradient(view, voxels, at, &g));
    if (!any_lane(MASK(o.alpha > 0.0f))) return;
    o.colour = shade(view, gradient_world(view, g), ray_world(view, p->x, p->y), o.colour);
#else
    Optical o = classify(params, table, inner_raw(view, voxels, at));
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
    Optical o = classify(params, table, sample_raw(view, voxels, at));
    Real part = 1.0f - exp2(log2(1.0f - o.alpha) * (length / view->step));
    o.alpha = select((Real)(0.0f), select(part, o.alpha, MASK(length >= view->step)), inside);
    if (!any_lane(MASK(o.alpha > 0.0f))) return;
#if SHADED
    o.colour = shade(view, gradient_world(view, gradient_raw(view, voxels, at)), ray_world(view, p->x, p->y), o.colour);
#endif
    composite(params, o, r);
}

static inline void step(constant const View *view, constant const EmissionAbsorption *params, global const uchar *voxels,
                        global const uchar *table, const Packet *p, int k, Radiance *r) {
    if (k >= p->inner && k < p->inner_end) inner_step(view, params, voxels, table, p, (float)k * view->step, r);
    else edge_step(view, params, voxels, table, p, k, r);
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
    }
#if BACK_TO_FRONT
    for (int k = beam.end - 1; k >= beam.begin; k--)
        for (int i = 0; i < PACKETS; i++) step(view, params, voxels, table, &packets[i], k, &r[i]);
#else
    int going = (1 << PACKETS) - 1;
    for (int k = beam.begin; k < beam.end && going;) {
        int leap = beam_leap(view, &beam, distances, k);
        k += leap;
        if (leap > 0) continue;
        int end = min(k + STRIDE, beam.end);
        for (; k < end; k++)
            for (int i = 0; i < PACKETS; i++)
                if (going >> i & 1) step(view, params, voxels, table, &packets[i], k, &r[i]);
        going = 0;
        for (int i = 0; i < PACKETS; i++) {
            Mask on = MASK(r[i].transmittance > params->transmittance_floor) & MASK(packets[i].ray.t_far > (float)k * view->step);
            going |= any_lane(on) ? 1 << i : 0;
        }
    }
#endif
    for (int i = 0; i < PACKETS; i++)
        film_packet(view, film, counts, packets[i].column, packets[i].row, r[i].colour, 1.0f - r[i].transmittance);
}
