// The principal curvatures of the isosurface through a point (Kindlmann, Whitaker, Tasdizen, Möller, "Curvature-Based Transfer
// Functions for Direct Volume Rendering", IEEE Visualization 2003): from gradient g and Hessian H of the cubic B-spline
// through the voxels, with n = -g / |g|, P = 1 - n n^T, G = -P H P / |g|, T = trace G, F = |G|_F:
// kappa_1,2 = (T ± sqrt(2 F² - T²)) / 2. Positive where the surface of something bright is convex.
#ifndef SHARED_CURVATURE_H
#define SHARED_CURVATURE_H

#include "shared/lanes.h"
#include "shared/volume.h"

typedef struct { Real xx, yy, zz, xy, xz, yz; } Symmetric;

typedef struct { Real value; Real3 gradient; Symmetric hessian; } Jet;

typedef struct { Real first, second; Symmetric normal_change; } Curvature;

static inline void b_spline_weights(Real f, Real w[4], Real d[4], Real dd[4]) {
    Real g = 1.0f - f, ff = f * f, gg = g * g;
    w[0] = gg * g * (1.0f / 6.0f), w[3] = ff * f * (1.0f / 6.0f);
    w[1] = mad(ff, 0.5f * f - 1.0f, (Real)(2.0f / 3.0f)), w[2] = mad(gg, 0.5f * g - 1.0f, (Real)(2.0f / 3.0f));
    d[0] = -0.5f * gg, d[3] = 0.5f * ff;
    d[1] = mad(1.5f * f, f, -2.0f * f), d[2] = mad(-1.5f * g, g, 2.0f * g);
    dd[0] = g, dd[1] = mad(f, 3.0f, (Real)(-2.0f)), dd[2] = mad(g, 3.0f, (Real)(-2.0f)), dd[3] = f;
}

// Raw value, gradient and Hessian at p, index units.
static inline Jet b_spline_jet(constant const View *view, VOLUME voxels, Real3 p) {
    Real3 low = real3(floor(p.x - 0.5f), floor(p.y - 0.5f), floor(p.z - 0.5f));
    Real wx[4], wy[4], wz[4], dx[4], dy[4], dz[4], ex[4], ey[4], ez[4];
    b_spline_weights(p.x - 0.5f - low.x, wx, dx, ex);
    b_spline_weights(p.y - 0.5f - low.y, wy, dy, ey);
    b_spline_weights(p.z - 0.5f - low.z, wz, dz, ez);
    Int x = to_int(low.x) - 1, y = to_int(low.y) - 1, z = to_int(low.z) - 1;
    Real zero = (Real)(0.0f);
    Jet j = {zero, {zero, zero, zero}, {zero, zero, zero, zero, zero, zero}};
    for (int c = 0; c < 4; c++)
        for (int b = 0; b < 4; b++) {
            Real row = zero, slope = zero, bend = zero;
            for (int a = 0; a < 4; a++) {
                Real v = voxel_raw(view, voxels, x + a, y + b, z + c);
                row = mad(wx[a], v, row);
                slope = mad(dx[a], v, slope);
                bend = mad(ex[a], v, bend);
            }
            Real ww = wy[b] * wz[c], dw = dy[b] * wz[c], wd = wy[b] * dz[c];
            j.value = mad(ww, row, j.value);
            j.gradient.x = mad(ww, slope, j.gradient.x);
            j.gradient.y = mad(dw, row, j.gradient.y);
            j.gradient.z = mad(wd, row, j.gradient.z);
            j.hessian.xx = mad(ww, bend, j.hessian.xx);
            j.hessian.yy = mad(ey[b] * wz[c], row, j.hessian.yy);
            j.hessian.zz = mad(wy[b] * ez[c], row, j.hessian.zz);
            j.hessian.xy = mad(dw, slope, j.hessian.xy);
            j.hessian.xz = mad(wd, slope, j.hessian.xz);
            j.hessian.yz = mad(dy[b] * dz[c], row, j.hessian.yz);
        }
    return j;
}

static inline Real3 times(Symmetric m, Real3 v) {
    return real3(mad(m.xx, v.x, mad(m.xy, v.y, m.xz * v.z)), mad(m.xy, v.x, mad(m.yy, v.y, m.yz * v.z)),
                 mad(m.xz, v.x, mad(m.yz, v.y, m.zz * v.z)));
}

// m H m^T for a row-major matrix m.
static inline Symmetric congruent(constant const float *m, Symmetric h) {
    Real3 r0 = real3((Real)(m[0]), (Real)(m[1]), (Real)(m[2])), r1 = real3((Real)(m[3]), (Real)(m[4]), (Real)(m[5]));
    Real3 r2 = real3((Real)(m[6]), (Real)(m[7]), (Real)(m[8]));
    Real3 h0 = times(h, r0), h1 = times(h, r1), h2 = times(h, r2);
    Symmetric s = {dot3(r0, h0), dot3(r1, h1), dot3(r2, h2), dot3(r0, h1), dot3(r0, h2), dot3(r1, h2)};
    return s;
}

// The principal curvatures (first >= second), per world unit, from the world gradient and Hessian; 0 where the field is flat.
static inline Curvature curvature(constant const View *view, Real3 g, Symmetric h) {
    Real squared = dot3(g, g);
    Mask flat = MASK(!(squared > view->flat_squared));
    Real inverse = select(rsqrt(squared), (Real)(0.0f), flat);
    Real3 n = scale3(g, inverse);
    // P H P = H - n (Hn)^T - (Hn) n^T + n n^T (n.Hn)
    Real3 hn = times(h, n);
    Real nhn = dot3(n, hn);
    Curvature c;
    #define PROJECTED(ij, i, j) ((h.ij - n.i * hn.j - hn.i * n.j + n.i * n.j * nhn) * -inverse)
    c.normal_change.xx = PROJECTED(xx, x, x), c.normal_change.yy = PROJECTED(yy, y, y), c.normal_change.zz = PROJECTED(zz, z, z);
    c.normal_change.xy = PROJECTED(xy, x, y), c.normal_change.xz = PROJECTED(xz, x, z), c.normal_change.yz = PROJECTED(yz, y, z);
    #undef PROJECTED
    Symmetric s = c.normal_change;
    Real trace = s.xx + s.yy + s.zz;
    Real frobenius = mad(s.xx, s.xx, mad(s.yy, s.yy, s.zz * s.zz)) + 2.0f * mad(s.xy, s.xy, mad(s.xz, s.xz, s.yz * s.yz));
    Real root = sqrt(fmax(2.0f * frobenius - trace * trace, (Real)(0.0f)));
    c.first = 0.5f * (trace + root);
    c.second = 0.5f * (trace - root);
    return c;
}

#endif
