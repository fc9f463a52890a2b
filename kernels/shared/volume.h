// A volume in its own voxel type, x fastest. Index coordinates are cell-cornered: voxel i has its centre at i + 0.5 and the box is [0, n]. Outside
// the outermost centres the edge value holds. The buffer is padded by 8 zero bytes.
#ifndef SHARED_VOLUME_H
#define SHARED_VOLUME_H

#include "shared/image.h"
#include "shared/lanes.h"
#include "shared/voxel.h"
#include "shared/voxel_lanes.h"

// INTERPOLATION selects the interpolation between voxels.
#ifndef INTERPOLATION
#error "a kernel that reads volumes is built with an INTERPOLATION"
#endif

// A volume is a buffer or a 3D image. The functions that read it have a body for each.

// One voxel per lane; the index is clamped to the grid.
static inline Real voxel_raw(constant const View *view, VOLUME voxels, Int x, Int y, Int z) {
    x = clamp(x, (Int)(0), (Int)(view->dims[0] - 1));
    y = clamp(y, (Int)(0), (Int)(view->dims[1] - 1));
    z = clamp(z, (Int)(0), (Int)(view->dims[2] - 1));
    return voxel_at(view->dims, voxels, x, y, z);
}

// The value of the voxel that contains p.
static inline Real nearest_raw(constant const View *view, VOLUME voxels, Real3 p) {
    return voxel_raw(view, voxels, to_int(floor(p.x)), to_int(floor(p.y)), to_int(floor(p.z)));
}

#if INTERPOLATION == INTERPOLATION_TRILINEAR || INTERPOLATION == INTERPOLATION_NEAREST
#define TAPS 2
#else
#define TAPS 4
#endif

// The weights of the voxels around a position, and their derivatives; f is its distance from the voxel before it, from 0 to 1.
// Cubic B-spline (approximating) and Catmull-Rom (interpolating): Mitchell & Netravali, SIGGRAPH 1988, with (B, C) = (1, 0)
// and (0, 1/2).
static inline void tap_weights(Real f, Real weight[TAPS], Real slope[TAPS]) {
#if TAPS == 2
    weight[0] = 1.0f - f, weight[1] = f;
    slope[0] = (Real)(-1.0f), slope[1] = (Real)(1.0f);
#else
    Real g = 1.0f - f, ff = f * f, gg = g * g;
#if INTERPOLATION == INTERPOLATION_B_SPLINE
    weight[0] = gg * g * (1.0f / 6.0f), weight[3] = ff * f * (1.0f / 6.0f);
    weight[1] = mad(ff, 0.5f * f - 1.0f, (Real)(2.0f / 3.0f)), weight[2] = mad(gg, 0.5f * g - 1.0f, (Real)(2.0f / 3.0f));
    slope[0] = -0.5f * gg, slope[3] = 0.5f * ff;
    slope[1] = mad(1.5f * f, f, -2.0f * f), slope[2] = mad(-1.5f * g, g, 2.0f * g);
#else
    weight[0] = -0.5f * f * gg, weight[3] = -0.5f * g * ff;
    weight[1] = mad(ff, 1.5f * f - 2.5f, (Real)(1.0f)), weight[2] = mad(gg, 1.5f * g - 2.5f, (Real)(1.0f));
    slope[0] = mad(mad(f, -1.5f, (Real)(2.0f)), f, (Real)(-0.5f)), slope[3] = -mad(mad(g, -1.5f, (Real)(2.0f)), g, (Real)(-0.5f));
    slope[1] = mad(4.5f * f, f, -5.0f * f), slope[2] = -mad(4.5f * g, g, -5.0f * g);
#endif
#endif
}

// The value at p and the gradient of the interpolant itself, in index units, tap by tap.
static inline Real taps_raw(constant const View *view, VOLUME voxels, Real3 p, Real3 *gradient) {
    Real3 low = real3(floor(p.x - 0.5f), floor(p.y - 0.5f), floor(p.z - 0.5f));
    Real wx[TAPS], wy[TAPS], wz[TAPS], dx[TAPS], dy[TAPS], dz[TAPS];
    tap_weights(p.x - 0.5f - low.x, wx, dx);
    tap_weights(p.y - 0.5f - low.y, wy, dy);
    tap_weights(p.z - 0.5f - low.z, wz, dz);
    Int x = to_int(low.x) - (TAPS / 2 - 1), y = to_int(low.y) - (TAPS / 2 - 1), z = to_int(low.z) - (TAPS / 2 - 1);
    Real value = (Real)(0.0f);
    *gradient = real3(value, value, value);
    for (int k = 0; k < TAPS; k++)
        for (int j = 0; j < TAPS; j++) {
            Real row = (Real)(0.0f), row_slope = (Real)(0.0f);
            for (int i = 0; i < TAPS; i++) {
                Real v = voxel_raw(view, voxels, x + i, y + j, z + k);
                row = mad(wx[i], v, row);
                row_slope = mad(dx[i], v, row_slope);
            }
            value = mad(wy[j] * wz[k], row, value);
            gradient->x = mad(wy[j] * wz[k], row_slope, gradient->x);
            gradient->y = mad(dy[j] * wz[k], row, gradient->y);
            gradient->z = mad(wy[j] * dz[k], row, gradient->z);
        }
    return value;
}

#if VOLUMES_ARE_IMAGES
// The raw value (before slope and intercept) at p, trilinear.
static inline Real trilinear_raw(constant const View *view, VOLUME voxels, Real3 p) {
    return read_imagef(voxels, linear_sampler, (float4)(p.x, p.y, p.z, 0.0f)).x * CHANNEL_SCALE;
}
#else
// Two neighbours in x, by one load if their bits fit in a word: the cost of a sample is its loads, not its arithmetic.
static inline Real lerp_x(global const uchar *voxels, Int byte_offset, Real f) {
#if VOXEL == VOXEL_F32
    Int first, second;
    gather_pairs(voxels, byte_offset, &first, &second);
    Real a = as_Real(first), b = as_Real(second);
#else
    Int pair = gather_words(voxels, byte_offset);
#if VOXEL == VOXEL_U8
    Real a = to_real(pair & 0xff), b = to_real((pair >> 8) & 0xff);
#elif VOXEL == VOXEL_I16
    Real a = to_real((pair << 16) >> 16), b = to_real(pair >> 16);
#else
    Real a = to_real(pair & 0xffff), b = to_real(as_Int(as_UInt(pair) >> 16));
#endif
#endif
    return mad(b - a, f, a);
}

// The raw value (before slope and intercept) at p, trilinear. A NaN voxel makes all of its eight cells NaN.
static inline Real trilinear_raw(constant const View *view, VOLUME voxels, Real3 p) {
    int nx = view->dims[0], ny = view->dims[1], nz = view->dims[2];
    Real x = clamp(p.x - 0.5f, (Real)(0.0f), (Real)(nx - 1));
    Real y = clamp(p.y - 0.5f, (Real)(0.0f), (Real)(ny - 1));
    Real z = clamp(p.z - 0.5f, (Real)(0.0f), (Real)(nz - 1));
    Int ix = min(to_int(x), (Int)(max(nx - 2, 0))), iy = min(to_int(y), (Int)(max(ny - 2, 0))), iz = min(to_int(z), (Int)(max(nz - 2, 0)));
    Real fx = x - to_real(ix), fy = y - to_real(iy), fz = z - to_real(iz);
    int row = (ny > 1 ? nx : 0) * VOXEL_BYTES, sheet = (nz > 1 ? nx * ny : 0) * VOXEL_BYTES;
    Int at = ((iz * ny + iy) * nx + ix) * VOXEL_BYTES;
    Real near = lerp_x(voxels, at, fx), low = lerp_x(voxels, at + row, fx);
    Real far = lerp_x(voxels, at + sheet, fx), deep = lerp_x(voxels, at + (row + sheet), fx);
    Real front = mad(low - near, fy, near), back = mad(deep - far, fy, far);
    return mad(back - front, fz, front);
}
#endif

// The raw value at p by the compiled-in interpolation.
static inline Real sample_raw(constant const View *view, VOLUME voxels, Real3 p) {
#if INTERPOLATION == INTERPOLATION_NEAREST
    return nearest_raw(view, voxels, p);
#elif INTERPOLATION == INTERPOLATION_TRILINEAR
    return trilinear_raw(view, voxels, p);
#else
    Real3 unused;
    return taps_raw(view, voxels, p, &unused);
#endif
}

// The gradient of the raw value in index units, by central differences one voxel to each side.
static inline Real3 gradient_raw(constant const View *view, VOLUME voxels, Real3 p) {
    Real3 g;
    g.x = sample_raw(view, voxels, real3(p.x + 1.0f, p.y, p.z)) - sample_raw(view, voxels, real3(p.x - 1.0f, p.y, p.z));
    g.y = sample_raw(view, voxels, real3(p.x, p.y + 1.0f, p.z)) - sample_raw(view, voxels, real3(p.x, p.y - 1.0f, p.z));
    g.z = sample_raw(view, voxels, real3(p.x, p.y, p.z + 1.0f)) - sample_raw(view, voxels, real3(p.x, p.y, p.z - 1.0f));
    return scale3(g, (Real)(0.5f));
}

#endif
