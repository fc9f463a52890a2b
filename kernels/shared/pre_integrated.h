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
// The table: at each entry the integrals from the first entry of sigma, sigma r, sigma g, sigma b over places on an even table, then their integrands.
static inline Real integral(global const uchar *table, int which, Real position) {
    Int i = min(to_int(position), (Int)(TABLE_SIZE - 2));
    global const float *column = (global const float *)table + which;
    Real low = gather_reals(column, i << 3), high = gather_reals(column + 8, i << 3);
    return mad(high - low, position - to_real(i), low);
}

// An end of a step: the place of its value on an even table, and the position in the table.
typedef struct { Real even, position; } End;

// Between the two ends of a step the value is taken to be linear. The mean of a quantity over them is the difference of its integrals over the
// difference of the values (Engel, Kraus, Ertl, "High-Quality Pre-Integrated Volume Rendering Using Hardware-Accelerated Pixel Shading", 2001), so
// the error falls with the square of the step. A ray that turns between them has values beyond both: what is there and nowhere else, as a thin shell
// around a maximum, is missed. Values close together take the integrand in their middle.
static inline Real between(global const uchar *table, int which, End a, End b, Mask close) {
    Real middle = gather_reals((global const float *)table + 4 + which, to_int(0.5f * (a.position + b.position) + 0.5f) << 3);
    if (!any_lane(~close)) return middle;
    Real difference = integral(table, which, b.position) - integral(table, which, a.position);
    return select(difference / select(b.even - a.even, (Real)(1.0f), close), middle, close);
}

// The end of a step at t, and the lanes in `*there` that have a value.
static inline End end_at(constant const View *view, constant const EmissionAbsorption *params, VOLUME voxels, global const uchar *table,
                         const Packet *p, Real t, Mask *there) {
    Real raw = sample_raw(view, voxels, along(p->ray.origin, p->ray.direction, t));
    *there &= MASK(raw == raw);
    End end;
    end.even = select((Real)(0.0f), even_position(params, raw, 1.0f), *there);
    end.position = params->knots ? warped(params, table, end.even) : end.even;
    return end;
}

static inline void preintegrated_step(constant const View *view, constant const EmissionAbsorption *params, VOLUME voxels,
                                      global const uchar *table, const Packet *p, int k, Radiance *r) {
    Real from = fmax((Real)((float)k * view->step), p->ray.t_near), to = fmin((Real)((float)(k + 1) * view->step), p->ray.t_far);
    Mask inside = MASK(to > from);
    if (!any_lane(inside)) return;
    End a = end_at(view, params, voxels, table, p, from, &inside), b = end_at(view, params, voxels, table, p, to, &inside);
    // Knots may leave few entries to wide ranges of values, which are no less apart for that.
    Mask close = MASK(fabs(b.position - a.position) < 4.0f) & MASK(fabs(b.even - a.even) < 4.0f);
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
