// Steps whose transfer function is integrated between their ends.
#ifndef SHARED_PRE_INTEGRATED_H
#define SHARED_PRE_INTEGRATED_H

#include "shared/camera.h"
#include "shared/lanes.h"
#include "shared/optical.h"
#include "shared/packet.h"
#include "shared/radiance.h"
#include "shared/shade.h"
#include "shared/volume.h"

#if PREINTEGRATED
// The table: at each entry the integrals from the first entry of sigma, sigma r, sigma g, sigma b, then their integrands. Beyond the table the
// integrands keep their values at its ends.
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

// Between the two ends of a step the value is taken to be linear. The mean of a quantity over them is the difference of its integrals over the
// difference of the values (Engel, Kraus, Ertl, "High-Quality Pre-Integrated Volume Rendering Using Hardware-Accelerated Pixel Shading", 2001), so
// the error falls with the square of the step. Values close together take the integrand in their middle.
static inline Real between(global const uchar *table, int which, Real a, Real b, Mask close) {
    Real position = clamp(0.5f * (a + b) + 0.5f, (Real)(0.0f), (Real)(TABLE_SIZE - 1));
    Real middle = gather_reals((global const float *)table + 4 + which, to_int(position) << 3);
    if (!any_lane(~close)) return middle;
    Real mean = (integral(table, which, b) - integral(table, which, a)) / select(b - a, (Real)(1.0f), close);
    return select(mean, middle, close);
}

// The position of the value at t in the table, neither rounded nor clamped; NaN if the value is.
static inline Real table_position_at(constant const View *view, constant const EmissionAbsorption *params, VOLUME voxels, const Packet *p,
                            Real t) {
    Real raw = sample_raw(view, voxels, along(p->ray.origin, p->ray.direction, t));
    return clamp(mad(raw, (Real)(params->table_scale), (Real)(params->table_offset - 0.5f)), (Real)(-1e7f), (Real)(1e7f)) + 0.0f * raw;
}

static inline void preintegrated_step(constant const View *view, constant const EmissionAbsorption *params, VOLUME voxels,
                                      global const uchar *table, const Packet *p, int k, Radiance *r) {
    Real from = fmax((Real)((float)k * view->step), p->ray.t_near), to = fmin((Real)((float)(k + 1) * view->step), p->ray.t_far);
    Mask inside = MASK(to > from);
    if (!any_lane(inside)) return;
    Real a = table_position_at(view, params, voxels, p, from), b = table_position_at(view, params, voxels, p, to);
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
    o.colour = shade(view, gradient_raw(view, voxels, at), 1.0f, p->half_way, o.colour);
#endif
    composite(params, o, r);
}
#endif

#endif
