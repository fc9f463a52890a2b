// The exact walk: from one plane at which the interpolant changes its polynomial to the next (Amanatides & Woo, Eurographics 1987; Siddon, Medical
// Physics 12(2), 1985). The planes are the voxels' faces for `nearest`, else the planes of their centres. Between two of them the value along a ray
// is a polynomial in t, of degree 0 (nearest), 3 (trilinear) or 9 (cubic), and Gauss-Legendre with 1, 2 or 5 points integrates it exactly. Beyond the
// outermost centres the edge value holds, which is a polynomial too. Stretches that touch a NaN count neither in the integral nor in the length.
#ifndef SHARED_WALK_H
#define SHARED_WALK_H

#include "shared/lanes.h"
#include "shared/volume.h"

#if INTERPOLATION == INTERPOLATION_NEAREST
#define WALK_PLANE 0.0f
#else
#define WALK_PLANE 0.5f
#endif

typedef struct {
    Real integral; // of the raw value
    Real length;   // of the stretches with a value, world units
    Real best;     // greatest sign * raw value; -INFINITY if there is none
} Walk;

typedef struct { Real origin, inverse, plane, towards; float last; } Crossing; // the next plane across one axis

static inline Crossing crossing_from(Real origin, Real direction, Real t, int n) {
    Crossing c;
    Real d = select(direction, copysign((Real)(1e-20f), direction), MASK(fabs(direction) < 1e-20f));
    Real at = mad(d, t, origin) - WALK_PLANE;
    c.origin = origin - WALK_PLANE;
    c.inverse = 1.0f / d;
    c.towards = copysign((Real)(1.0f), d);
    c.plane = select(ceil(at) - 1.0f, floor(at) + 1.0f, MASK(d > 0.0f));
    c.last = (float)(INTERPOLATION == INTERPOLATION_NEAREST ? n : n - 1);
    return c;
}

// The t of the crossing; infinite without a further plane.
static inline Real crossing_time(const Crossing *c) {
    Real t = (c->plane - c->origin) * c->inverse;
    return select((Real)(1e30f), t, MASK(c->plane >= 0.0f) & MASK(c->plane <= c->last));
}

#if INTERPOLATION == INTERPOLATION_TRILINEAR
typedef struct { Real3 low; Real v[8]; } Corners;

#if VOLUMES_ARE_IMAGES
// The eight voxels around p, and the lowest corner; indices are clamped to the grid.
static inline Corners corners_at(constant const View *view, VOLUME voxels, Real3 p) {
    Corners c;
    c.low = real3(floor(p.x - 0.5f), floor(p.y - 0.5f), floor(p.z - 0.5f));
    Int x = to_int(c.low.x), y = to_int(c.low.y), z = to_int(c.low.z);
    for (int i = 0; i < 8; i++) c.v[i] = voxel_raw(view, voxels, x + (i & 1), y + (i >> 1 & 1), z + (i >> 2));
    return c;
}
#else
// The raw values of two neighbours in x.
static inline void pair_raw(global const uchar *voxels, Int at, Real *a, Real *b) {
#if VOXEL == VOXEL_F32
    Int first, second;
    gather_pairs(voxels, at, &first, &second);
    *a = as_Real(first), *b = as_Real(second);
#else
    Int pair = gather_words(voxels, at);
#if VOXEL == VOXEL_U8
    *a = to_real(pair & 0xff), *b = to_real((pair >> 8) & 0xff);
#elif VOXEL == VOXEL_I16
    *a = to_real((pair << 16) >> 16), *b = to_real(pair >> 16);
#else
    *a = to_real(pair & 0xffff), *b = to_real(as_Int(as_UInt(pair) >> 16));
#endif
#endif
}

// The eight voxels around p, and the lowest corner. Beyond the outermost centres both voxels of a pair are the one at the edge, so that a NaN further
// in has no effect there.
static inline Corners corners_at(constant const View *view, VOLUME voxels, Real3 p) {
    int nx = view->dims[0], ny = view->dims[1], nz = view->dims[2];
    Corners c;
    c.low = real3(floor(p.x - 0.5f), floor(p.y - 0.5f), floor(p.z - 0.5f));
    Int x = to_int(c.low.x), y = to_int(c.low.y), z = to_int(c.low.z);
    Mask edge = MASK(x < 0) | MASK(x >= nx - 1);
    x = clamp(x, (Int)(0), (Int)(nx - 1));
    Int rows[2] = {clamp(y, (Int)(0), (Int)(ny - 1)), clamp(y + 1, (Int)(0), (Int)(ny - 1))};
    Int sheets[2] = {clamp(z, (Int)(0), (Int)(nz - 1)), clamp(z + 1, (Int)(0), (Int)(nz - 1))};
    for (int i = 0; i < 4; i++) {
        pair_raw(voxels, ((sheets[i >> 1] * ny + rows[i & 1]) * nx + x) * VOXEL_BYTES, &c.v[2 * i], &c.v[2 * i + 1]);
        c.v[2 * i + 1] = select(c.v[2 * i + 1], c.v[2 * i], edge);
    }
    return c;
}
#endif

static inline Real corners_raw(const Corners *c, Real3 p) {
    Real fx = clamp(p.x - 0.5f - c->low.x, (Real)(0.0f), (Real)(1.0f));
    Real fy = clamp(p.y - 0.5f - c->low.y, (Real)(0.0f), (Real)(1.0f));
    Real fz = clamp(p.z - 0.5f - c->low.z, (Real)(0.0f), (Real)(1.0f));
    Real a = mad(c->v[1] - c->v[0], fx, c->v[0]), b = mad(c->v[3] - c->v[2], fx, c->v[2]);
    Real d = mad(c->v[5] - c->v[4], fx, c->v[4]), e = mad(c->v[7] - c->v[6], fx, c->v[6]);
    Real front = mad(b - a, fy, a), back = mad(e - d, fy, d);
    return mad(back - front, fz, front);
}

static inline void keep_greatest(Real *best, Real v) { *best = select(*best, v, MASK(v > *best)); }

// The greatest of sign times the cubic along the stretch: at its ends, or at a zero of its derivative. The value is always taken from the interpolant
// itself, so that a rounding error in a root costs the square of it.
static inline void stretch_peak(const Corners *c, float sign, Real3 o, Real3 d, Real t, Real length, Mask on, Real *best) {
    Real f[4], peak = *best;
    for (int i = 0; i < 4; i++) {
        f[i] = sign * corners_raw(c, along(o, d, mad(length, (Real)((float)i / 3.0f), t)));
        keep_greatest(&peak, f[i]);
    }
    Real c1 = -5.5f * f[0] + 9.0f * f[1] - 4.5f * f[2] + f[3];
    Real c2 = 9.0f * f[0] - 22.5f * f[1] + 18.0f * f[2] - 4.5f * f[3];
    Real c3 = -4.5f * f[0] + 13.5f * f[1] - 13.5f * f[2] + 4.5f * f[3];
    Real root = sqrt(fmax(mad(c2, c2, -3.0f * c1 * c3), (Real)(0.0f)));
    Real q = -(c2 + copysign(root, c2));
    Real u[2] = {q / (3.0f * c3), c1 / q};
    for (int i = 0; i < 2; i++) {
        Mask inside = MASK(u[i] > 0.0f) & MASK(u[i] < 1.0f);
        Real at = select((Real)(0.5f), u[i], inside);
        keep_greatest(&peak, sign * corners_raw(c, along(o, d, mad(length, at, t))));
    }
    *best = select(*best, peak, on);
}
#endif

// One stretch from t on: the mean of the raw value over it, and with `peaks` the greatest of sign times it (exact for nearest and trilinear; for the
// cubics the greatest of the five points).
static inline Real stretch(constant const View *view, VOLUME voxels, float sign, int peaks, Real3 o, Real3 d, Real t, Real length,
                           Mask on, Real *best) {
    Real middle = mad(length, (Real)(0.5f), t);
#if INTERPOLATION == INTERPOLATION_NEAREST
    Real v = nearest_raw(view, voxels, along(o, d, middle));
    *best = select(*best, sign * v, on & MASK(sign * v > *best));
    return v;
#elif INTERPOLATION == INTERPOLATION_TRILINEAR
    Corners c = corners_at(view, voxels, along(o, d, middle));
    if (peaks) {
        stretch_peak(&c, sign, o, d, t, length, on, best);
        return (Real)(0.0f);
    }
    Real offset = length * 0.288675135f; // 1 / (2 sqrt 3)
    return 0.5f * (corners_raw(&c, along(o, d, middle - offset)) + corners_raw(&c, along(o, d, middle + offset)));
#else
    const float node[5] = {-0.453089923f, -0.269234655f, 0.0f, 0.269234655f, 0.453089923f};
    const float weight[5] = {0.118463443f, 0.239314335f, 0.284444444f, 0.239314335f, 0.118463443f};
    Real sum = (Real)(0.0f);
    for (int i = 0; i < 5; i++) {
        Real v = sample_raw(view, voxels, along(o, d, mad(length, (Real)(node[i]), middle)));
        sum = mad((Real)(weight[i]), v, sum);
        *best = select(*best, sign * v, on & MASK(sign * v > *best));
    }
    return sum;
#endif
}

static inline Walk walk(constant const View *view, VOLUME voxels, float sign, int peaks, Real3 o, Real3 d, Real t_near,
                        Real t_far) {
    Walk w = {(Real)(0.0f), (Real)(0.0f), (Real)(-INFINITY)};
    Crossing x = crossing_from(o.x, d.x, t_near, view->dims[0]), y = crossing_from(o.y, d.y, t_near, view->dims[1]);
    Crossing z = crossing_from(o.z, d.z, t_near, view->dims[2]);
    Real t = t_near;
    Mask alive = MASK(t < t_far);
    // A line crosses each plane once. The bound only guards against rounding.
    int most = view->dims[0] + view->dims[1] + view->dims[2] + 8;
    for (int i = 0; i < most && any_lane(alive); i++) {
        Real tx = crossing_time(&x), ty = crossing_time(&y), tz = crossing_time(&z);
        Real to = fmax(fmin(fmin(tx, ty), fmin(tz, t_far)), t);
        Real length = select((Real)(0.0f), to - t, alive);
        Mask on = MASK(length > 0.0f);
        Real mean = stretch(view, voxels, sign, peaks, o, d, t, length, on, &w.best);
        on &= MASK(mean == mean);
        w.integral += select((Real)(0.0f), mean * length, on);
        w.length += select((Real)(0.0f), length, on);
        x.plane += select((Real)(0.0f), x.towards, MASK(tx <= to));
        y.plane += select((Real)(0.0f), y.towards, MASK(ty <= to));
        z.plane += select((Real)(0.0f), z.towards, MASK(tz <= to));
        t = select(t, to, alive);
        alive &= MASK(t < t_far);
    }
    return w;
}

#endif
