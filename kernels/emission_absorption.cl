// Emission and absorption along a ray: I = sum_k c_k a_k prod_{j<k} (1 - a_j), a = 1 - exp(-sigma ds)
// (Max, "Optical Models for Direct Volume Rendering", IEEE TVCG 1(2), 1995). One work-item is one beam of pixels.

#define TABLE_SIZE 4096

typedef struct { Real3 colour; Real alpha; } Optical;

typedef struct { Real3 colour; Real transmittance; } Radiance;

// A colour is kept as 1 + channel * 65535/65536 (blue: 4095/4096): then its bits in the table are those of a float's fraction.
// What is composited of it is too high by 1 - transmittance. Where samples are coloured one by one it is decoded before.
#define DECODED_EACH (SHADED || STYLED || PREINTEGRATED)
#define CHANNEL(bits, mask) as_Real(((bits) & (mask)) | 0x3f800000)

static inline Real3 decoded(Real3 colour, Real weight) {
    Real3 c = real3(fmax(colour.x - weight, (Real)(0.0f)), fmax(colour.y - weight, (Real)(0.0f)), fmax(colour.z - weight, (Real)(0.0f)));
    return real3(c.x * (65536.0f / 65535.0f), c.y * (65536.0f / 65535.0f), c.z * (4096.0f / 4095.0f));
}

// An entry of the table is two words: the opacity's float less its ten lowest bits, which hold the upper bits of blue, its two
// lowest above (an opacity is at most 1); then 16 bits each of red and green, turned right by 25 and 9 bits.
typedef struct { Int word, red_green; } Entry;

static inline Entry entry_at(global const uchar *table, Int index) {
    Entry e;
    gather_pairs(table, index, &e.word, &e.red_green);
    return e;
}

static inline Optical optical(Entry e) {
    Optical o;
    o.alpha = as_Real(e.word & 0x3ffffc00);
    Int green = as_Int(rotate(as_UInt(e.red_green), (UInt)(16u))), blue = as_Int(rotate(as_UInt(e.word), (UInt)(13u)));
    o.colour = real3(CHANNEL(e.red_green, 0x007fff80), CHANNEL(green, 0x007fff80), CHANNEL(blue, 0x007ff800));
    return o;
}

// Where the table has a raw value in units of `unit`.
static inline Int index_of(constant const EmissionAbsorption *params, Real raw, float unit) {
    Real x = mad(raw, (Real)(params->table_scale * unit), (Real)(params->table_offset));
    return to_int(clamp(x, (Real)(0.0f), (Real)(TABLE_SIZE - 1)));
}

// The transfer function at a raw value in units of `unit`, with the opacity of a whole step; a NaN is empty.
static inline Optical classify(constant const EmissionAbsorption *params, global const uchar *table, Real raw, float unit) {
#if VOXEL == VOXEL_F32
    Mask nan = MASK(raw != raw);
    Optical o = optical(entry_at(table, index_of(params, select(raw, (Real)(0.0f), nan), unit)));
    o.alpha = select(o.alpha, (Real)(0.0f), nan);
    return o;
#else
    return optical(entry_at(table, index_of(params, raw, unit)));
#endif
}

#if SHADED
// The colour of a sample of gradient g, in index units, under the lights.
static inline Real3 lit(constant const View *view, const Packet *p, Real3 g, Real3 colour) {
    return shade(view, gradient_world(view, g), p->half_way, decoded(colour, (Real)(1.0f)));
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

// The opacity of `times` the extinction: 1 - (1 - alpha)^times.
static inline Real opacity_times(Real alpha, Real times) {
    return select(1.0f - exp2(log2(1.0f - alpha) * times), (Real)(0.0f), MASK(times <= 0.0f));
}

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
    o.colour = styled_colour(view, params, &s, decoded(o.colour, (Real)(1.0f)));
    composite(params, o, r);
}
#endif

#if PREINTEGRATED
// The table: at each entry the integrals from the first of sigma, sigma r, sigma g, sigma b, then their integrands, which
// beyond the table stay what they are at its ends.
static inline Real integral(global const uchar *table, int which, Real x) {
    Real within = clamp(x, (Real)(0.0f), (Real)(TABLE_SIZE - 1));
    Int i = min(to_int(within), (Int)(TABLE_SIZE - 2));
    global const float *column = (global const float *)table + which;
    Real low = gather_reals(column, i << 3), high = gather_reals(column + 8, i << 3);
    Real sum = mad(high - low, within - to_real(i), low);
    Mask beyond = MASK(x != within);
    if (!any_lane(beyond)) return sum;
    return mad(x - within, gather_reals(column + 4, to_int(within) << 3), sum);
}

// Between two values taken at the ends of a step the value is taken to be linear: the mean of a quantity over them is the
// difference of its integrals over the difference of the values (Engel, Kraus, Ertl, "High-Quality Pre-Integrated Volume
// Rendering Using Hardware-Accelerated Pixel Shading", 2001), so the error falls with the square of the step. Values close
// together take the integrand in their middle.
static inline Real between(global const uchar *table, int which, Real a, Real b, Mask close) {
    Real place = clamp(0.5f * (a + b) + 0.5f, (Real)(0.0f), (Real)(TABLE_SIZE - 1));
    Real middle = gather_reals((global const float *)table + 4 + which, to_int(place) << 3);
    if (!any_lane(~close)) return middle;
    Real mean = (integral(table, which, b) - integral(table, which, a)) / select(b - a, (Real)(1.0f), close);
    return select(mean, middle, close);
}

// The place of the value at t in the table, neither rounded nor clamped; NaN where the value is.
static inline Real place_at(constant const View *view, constant const EmissionAbsorption *params, VOLUME voxels, const Packet *p,
                            Real t) {
    Real raw = sample_raw(view, voxels, along(p->ray.origin, p->ray.direction, t));
    return clamp(mad(raw, (Real)(params->table_scale), (Real)(params->table_offset - 0.5f)), (Real)(-1e7f), (Real)(1e7f)) + 0.0f * raw;
}

static inline void preintegrated_step(constant const View *view, constant const EmissionAbsorption *params, VOLUME voxels,
                                      global const uchar *table, const Packet *p, int k, Radiance *r) {
    Real from = fmax((Real)((float)k * view->step), p->ray.t_near), to = fmin((Real)((float)(k + 1) * view->step), p->ray.t_far);
    Mask inside = MASK(to > from);
    if (!any_lane(inside)) return;
    Real a = place_at(view, params, voxels, p, from), b = place_at(view, params, voxels, p, to);
    inside &= MASK(a == a) & MASK(b == b);
    a = select((Real)(0.0f), a, inside), b = select((Real)(0.0f), b, inside);
    Mask close = MASK(fabs(b - a) < 4.0f);
    Real sigma = between(table, 0, a, b, close), inverse = 1.0f / fmax(sigma, (Real)(1e-30f));
    Optical o;
    o.alpha = select((Real)(0.0f), 1.0f - exp(-sigma * (to - from)), inside & MASK(sigma > 0.0f));
    if (!any_lane(MASK(o.alpha > 0.0f))) return;
    o.colour = real3(between(table, 1, a, b, close) * inverse, between(table, 2, a, b, close) * inverse, between(table, 3, a, b, close) * inverse);
#if SHADED
    Real3 at = along(p->ray.origin, p->ray.direction, 0.5f * (from + to));
    o.colour = shade(view, gradient_world(view, gradient_raw(view, voxels, at)), p->half_way, o.colour);
#endif
    composite(params, o, r);
}
#endif

#if defined(NARROW) && !SHADED
// The steps from k to end - 1 of lanes that are close together, at most STRIDE of them: first where each is in the table, then what
// is there. Of two short loops the processor has several steps under way at once; of a long one it sees no further than about a step.
static inline void narrow_steps(constant const View *view, constant const EmissionAbsorption *params, VOLUME voxels,
                                global const uchar *table, const Packet *p, int k, int end, Radiance *r) {
    Int index[STRIDE];
    for (int i = 0; i < end - k; i++) {
        float at = (float)(k + i);
        Real raw = narrow_raw(view, voxels, along(p->start, p->pace, (Real)(at)), convert_int4(p->low + p->low_pace * at));
        index[i] = index_of(params, raw, INNER_UNIT);
    }
    for (int i = 0; i < end - k; i++) composite(params, optical(entry_at(table, index[i])), r);
}
#elif defined(NARROW)
// The same of lit samples, as a pipeline: while a step's voxels are on their way, those of the one before are interpolated, and the
// one before that is lit and composited.
static inline void narrow_steps(constant const View *view, constant const EmissionAbsorption *params, VOLUME voxels,
                                global const uchar *table, const Packet *p, int k, int end, Radiance *r) {
    WideBlock block = wide_block_at(view, voxels, convert_int4(p->low + p->low_pace * (float)k));
    Optical before = {{(Real)(0.0f), (Real)(0.0f), (Real)(0.0f)}, (Real)(0.0f)};
    Real3 gradient = before.colour;
    for (float at = (float)k; k < end; k++, at += 1.0f) {
        WideBlock next = wide_block_at(view, voxels, convert_int4(p->low + p->low_pace * fmin(at + 1.0f, (float)(end - 1))));
        Real3 place = along(p->start, p->pace, (Real)(at)), steep = gradient;
        Optical o = classify(params, table, wide_raw(&block, place), INNER_UNIT);
        if (any_lane(MASK(o.alpha > 0.0f))) steep = wide_gradient(&block, place);
        if (any_lane(MASK(before.alpha > 0.0f))) before.colour = lit(view, p, scale3(gradient, (Real)(INNER_UNIT)), before.colour);
        composite(params, before, r);
        before = o, gradient = steep, block = next;
    }
    before.colour = lit(view, p, scale3(gradient, (Real)(INNER_UNIT)), before.colour);
    composite(params, before, r);
}
#endif

// A whole step of every lane, away from the box's faces.
static inline void inner_step(constant const View *view, constant const EmissionAbsorption *params, VOLUME voxels,
                              global const uchar *table, const Packet *p, Real k, Radiance *r) {
    Real3 at = along(p->start, p->pace, k);
#if SHADED
    Real3 g;
    Optical o = classify(params, table, inner_gradient(view, voxels, at, &g), INNER_UNIT);
    if (!any_lane(MASK(o.alpha > 0.0f))) return;
    o.colour = lit(view, p, scale3(g, (Real)(INNER_UNIT)), o.colour);
#else
    Optical o = classify(params, table, inner_raw(view, voxels, at), INNER_UNIT);
#endif
    composite(params, o, r);
}

// Any step: only what of it is inside the lane's ray counts, and absorbs for that long.
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
    o.colour = lit(view, p, gradient_raw(view, voxels, at), o.colour);
#endif
    composite(params, o, r);
}

// The steps from k to end - 1 of a packet; what it gathers stays in registers meanwhile.
static inline void march(constant const View *view, constant const EmissionAbsorption *params, VOLUME voxels,
                         global const uchar *table, const Packet *p, int k, int end, Radiance *radiance) {
    Radiance r = *radiance;
#if PREINTEGRATED
    for (; k < end; k++) preintegrated_step(view, params, voxels, table, p, k, &r);
#elif STYLED
    for (; k < end; k++) styled_step(view, params, voxels, table, p, k, &r);
#endif
    while (k < end) {
#ifdef NARROW
        if (k >= p->inner && k < p->narrow_end) {
            int to = min(end, p->narrow_end);
            narrow_steps(view, params, voxels, table, p, k, to, &r);
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

kernel void emission_absorption(constant View *view, constant EmissionAbsorption *params, VOLUME voxels,
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
        Real3 colour = scale3(DECODED_EACH ? r[i].colour : decoded(r[i].colour, alpha), (Real)(params->brightness));
        film_packet(view, film, counts, packets[i].column, packets[i].row, colour, alpha);
    }
}
