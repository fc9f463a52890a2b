// Emission and absorption along a ray: I = sum_k c_k a_k prod_{j<k} (1 - a_j), a = 1 - exp(-sigma ds)
// (Max, "Optical Models for Direct Volume Rendering", IEEE TVCG 1(2), 1995). One work-item is one packet of pixels.

#define TABLE_SIZE 4096

typedef struct { Real3 colour; Real sigma; Mask solid; } Optical;

// The transfer function at a raw value: sigma from the first third of the table, colour as 16-bit pairs from the rest.
// A NaN value is empty.
static inline Optical classify(constant const EmissionAbsorption *params, global const float *table, Real raw) {
    Optical o;
    Mask finite = MASK(raw == raw);
    Real x = clamp(mad(raw, (Real)(params->table_scale), (Real)(params->table_offset)), (Real)(0.0f), (Real)(TABLE_SIZE - 1));
    Int entry = to_int(select((Real)(0.0f), x, finite));
    o.sigma = select((Real)(0.0f), gather_reals(table, entry), finite);
    o.solid = MASK(o.sigma > 0.0f);
    o.colour = real3(0.0f, 0.0f, 0.0f);
    if (any_lane(o.solid)) {
        Int rg = gather_ints((global const int *)(table + TABLE_SIZE), entry);
        Int b = gather_ints((global const int *)(table + 2 * TABLE_SIZE), entry);
        float unit = 1.0f / 65535.0f;
        o.colour = real3(to_real(rg & 0xffff) * unit, to_real((rg >> 16) & 0xffff) * unit, to_real(b & 0xffff) * unit);
    }
    return o;
}

#if SHADED
// Two-sided Lambert and Blinn-Phong (Blinn, SIGGRAPH 1977), with a light from infinity.
static inline Real3 shade(constant const View *view, constant const EmissionAbsorption *params, global const uchar *voxels,
                          Real3 p, Real3 colour, Real3 half_vector) {
    Real3 g = gradient_raw(view, voxels, p);
    constant const float *m = params->world_gradient_from_index;
    Real3 n = real3(m[0] * g.x + m[1] * g.y + m[2] * g.z, m[3] * g.x + m[4] * g.y + m[5] * g.z, m[6] * g.x + m[7] * g.y + m[8] * g.z);
    Real squared = dot3(n, n);
    Mask flat = MASK(!(squared > 1e-24f));
    Real scale = select(rsqrt(squared), (Real)(0.0f), flat);
    Real3 light = real3(params->light[0], params->light[1], params->light[2]);
    Real diffuse = fabs(dot3(n, light)) * scale, along_half = fabs(dot3(n, half_vector)) * scale;
    Real specular = params->specular * exp2(params->shininess * log2(fmax(along_half, (Real)(1e-6f))));
    // Where the field is flat there is no surface to turn towards the light: full diffuse, no highlight.
    Real body = params->ambient + params->diffuse * select(diffuse, (Real)(1.0f), flat);
    specular = select(specular, (Real)(0.0f), flat);
    return real3(mad(colour.x, body, specular), mad(colour.y, body, specular), mad(colour.z, body, specular));
}
#endif

typedef struct { Real3 colour; Real transmittance; } Radiance;

// One sample: absorb along `step` and add what is emitted, in the lanes of `active`.
static inline void composite(constant const View *view, constant const EmissionAbsorption *params, global const uchar *voxels,
                             global const float *table, Real3 p, Real step, Mask active, Real3 half_vector, Radiance *r) {
    Optical o = classify(params, table, sample_raw(view, voxels, p));
    Mask solid = o.solid & active;
    if (!any_lane(solid)) return;
#if SHADED
    o.colour = shade(view, params, voxels, p, o.colour, half_vector);
#endif
    Real through = exp(-o.sigma * step);
#if BACK_TO_FRONT
    Real opacity = select((Real)(0.0f), 1.0f - through, solid);
    r->colour = add3(scale3(r->colour, 1.0f - opacity), scale3(o.colour, opacity));
    r->transmittance *= 1.0f - opacity;
#else
    Real weight = select((Real)(0.0f), r->transmittance * (1.0f - through), solid);
    r->colour = add3(r->colour, scale3(o.colour, weight));
    r->transmittance -= weight;
#endif
}

// Marches the samples (k + jitter) step, k = 0 .. count - 1. Cells that the transfer function leaves empty are leapt over;
// a leap lands on a sample of the same sequence, so the picture is the one without leaps.
static inline Radiance march(constant const View *view, constant const EmissionAbsorption *params, global const uchar *voxels,
                             global const uchar *distances, global const float *table, Real3 entry, Real3 direction, Real step,
                             Int count, Real jitter, Real3 half_vector) {
    Radiance r;
    r.colour = real3(0.0f, 0.0f, 0.0f);
    r.transmittance = (Real)(1.0f);
#if BACK_TO_FRONT
    for (Int k = count - 1; any_lane(MASK(k >= 0)); k -= 1) {
        Real3 p = along(entry, direction, (to_real(k) + jitter) * step);
        composite(view, params, voxels, table, p, step, MASK(k >= 0), half_vector, &r);
    }
#else
    Int k = (Int)(0);
    Int last_x = (Int)((view->dims[0] - 1) >> 3), last_y = (Int)((view->dims[1] - 1) >> 3), last_z = (Int)((view->dims[2] - 1) >> 3);
    Mask alive = MASK(count > 0);
    while (any_lane(alive)) {
        Real s = (to_real(k) + jitter) * step;
        Real3 p = along(entry, direction, s);
        Int cx = clamp(to_int(p.x) >> 3, (Int)(0), last_x), cy = clamp(to_int(p.y) >> 3, (Int)(0), last_y), cz = clamp(to_int(p.z) >> 3, (Int)(0), last_z);
        Int distance = cell_distance(view, distances, cx, cy, cz);
        Mask empty = MASK(distance > 0) & alive;
        if (any_lane(empty)) {
            Real leave = fmin(leap_axis(p.x, direction.x, cx, distance), fmin(leap_axis(p.y, direction.y, cy, distance), leap_axis(p.z, direction.z, cz, distance)));
            Int next = to_int(fmin(ceil(mad(leave + s, 1.0f / step, -jitter)), to_real(count)));
            k = select(k, max(next, k + 1), empty);
            alive &= MASK(k < count);
        }
        if (!any_lane(alive & ~empty)) continue;
        // Four samples before the next look at the cells: looking costs about a quarter of a sample.
        for (int i = 0; i < 4; i++) {
            composite(view, params, voxels, table, along(entry, direction, (to_real(k) + jitter) * step), step, alive, half_vector, &r);
            k += 1;
            alive &= MASK(k < count) & MASK(r.transmittance > params->transmittance_floor);
        }
    }
#endif
    return r;
}

kernel void emission_absorption(constant View *view, constant EmissionAbsorption *params, global const uchar *voxels,
                                global const uchar *distances, global const float *table, global float *film, global uint *counts) {
    int tiles_wide = (view->width + TILE_W - 1) / TILE_W, tiles = tiles_wide * ((view->height + TILE_H - 1) / TILE_H);
    int tile = view->first_tile + (int)get_global_id(0);
    if (tile >= tiles) return;
    Int column = (tile % tiles_wide) * TILE_W + LANE_IDS % TILE_W, row = (tile / tiles_wide) * TILE_H + LANE_IDS / TILE_W;
    Mask inside = MASK(column < view->width) & MASK(row < view->height);
    Int full_column = column * view->stride, full_row = row * view->stride;

    UInt4Lanes ctr = {as_UInt(full_row * view->full_width + full_column), (UInt)(view->sample), (UInt)(0u), (UInt)(view->stream)};
    Real jitter = unit_open(philox(ctr, view->seed[0], view->seed[1]).a);
    Ray ray = camera_ray(view, to_real(full_column) + view->offset[0], to_real(full_row) + view->offset[1]);

    Real length = ray.t_far - ray.t_near;
    Mask hit = MASK(length > 0.0f) & inside;
    Real steps = clamp(ceil(length * (1.0f / view->step)), (Real)(1.0f), (Real)(65536.0f));
    Int count = select((Int)(0), to_int(steps), hit);
    Real step = select((Real)(1.0f), length / steps, hit);
    Real3 entry = along(ray.origin, ray.direction, ray.t_near);

    Real3 half_vector = real3(0.0f, 0.0f, 0.0f);
#if SHADED
    Real px = select((Real)(0.0f), to_real(full_column) + view->offset[0], (Int)(view->perspective));
    Real py = select((Real)(0.0f), to_real(full_row) + view->offset[1], (Int)(view->perspective));
    Real3 w = affine3(view->towards_world, view->right_world, view->down_world, px, py);
    Real norm = rsqrt(dot3(w, w));
    Real3 h = real3(params->light[0] - w.x * norm, params->light[1] - w.y * norm, params->light[2] - w.z * norm);
    half_vector = scale3(h, rsqrt(fmax(dot3(h, h), (Real)(1e-12f))));
#endif
    Radiance r = march(view, params, voxels, distances, table, entry, ray.direction, step, count, jitter, half_vector);

    RealLanes red, green, blue, alpha;
    IntLanes x, y;
    red.v = r.colour.x, green.v = r.colour.y, blue.v = r.colour.z, alpha.v = 1.0f - r.transmittance;
    x.v = column, y.v = row;
    for (int i = 0; i < LANES; i++)
        if (x.lane[i] < view->width && y.lane[i] < view->height)
            film_add(film, counts, y.lane[i] * view->width + x.lane[i], view->width * view->height, view->sample,
                     (float4)(red.lane[i], green.lane[i], blue.lane[i], alpha.lane[i]));
}
