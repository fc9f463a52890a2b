// The crossing of a ray with an isosurface, to a ten-thousandth of a voxel, and the surface's gradient and occlusion there.
#ifndef SHARED_CROSSING_H
#define SHARED_CROSSING_H

#include "shared/camera.h"
#include "shared/inner.h"
#include "shared/lanes.h"
#include "shared/packet.h"
#include "shared/rng.h"
#include "shared/volume.h"

// Two points of a ray between which the value passes the isovalue: f is the value less the isovalue.
typedef struct { Real t0, t1, f0, f1, isovalue; } Bracket;

static inline Bracket bracket(Real t, Real length, Real before, Real after, Real isovalue) {
    Bracket b = {t, t + length, before - isovalue, after - isovalue, isovalue};
    return b;
}

static inline Bracket select_bracket(Bracket no, Bracket yes, Mask m) {
    Bracket b = {select(no.t0, yes.t0, m), select(no.t1, yes.t1, m), select(no.f0, yes.f0, m), select(no.f1, yes.f1, m),
                 select(no.isovalue, yes.isovalue, m)};
    return b;
}

// The lanes that pass the isovalue. With `nearest`, as in the lecture, these are the lanes whose far end is at or beyond it.
static inline Mask crossed(constant const Isosurface *params, const Bracket *b) {
#if INTERPOLATION == INTERPOLATION_NEAREST
    return MASK(params->sign * b->f1 >= 0.0f);
#elif VOXEL == VOXEL_F32
    return (MASK(b->f0 < 0.0f) & MASK(b->f1 >= 0.0f)) | (MASK(b->f0 >= 0.0f) & MASK(b->f1 < 0.0f)); // never for NaN
#else
    return MASK(b->f0 < 0.0f) ^ MASK(b->f1 < 0.0f);
#endif
}

// The steps of regula falsi before halving: they bound the number of steps for any function.
#define REGULA_FALSI 10
#define REFINEMENTS 28

// The crossing in the bracket by regula falsi in the Illinois form, which halves the value of an end that stays (Dowell & Jarratt, BIT 11, 1971). It
// stops when the bracket is `tolerance` wide, and interpolates once more linearly within it.
static inline Real refined(constant const View *view, constant const Isosurface *params, VOLUME voxels, const Packet *p, Bracket b, Mask on) {
#if INTERPOLATION == INTERPOLATION_NEAREST
    return b.t1;
#else
    for (int i = 0; i < REFINEMENTS; i++) {
        Mask wide = on & MASK(fabs(b.t1 - b.t0) > params->tolerance) & MASK(b.f1 != 0.0f);
        if (!any_lane(wide)) break;
        Real part = i < REGULA_FALSI ? b.f1 / (b.f1 - b.f0) : (Real)(0.5f);
        Real t = mad(b.t0 - b.t1, part, b.t1);
        Real f = sample_raw(view, voxels, along(p->ray.origin, p->ray.direction, t)) - b.isovalue;
        wide &= MASK(f == f);
        Mask passed = MASK(f < 0.0f) ^ MASK(b.f1 < 0.0f);
        b.t0 = select(b.t0, b.t1, wide & passed);
        b.f0 = select(select(b.f0, 0.5f * b.f0, wide), b.f1, wide & passed);
        b.t1 = select(b.t1, t, wide);
        b.f1 = select(b.f1, f, wide);
    }
    Real rest = b.f1 - b.f0;
    return mad(b.t0 - b.t1, b.f1 / select(rest, (Real)(1.0f), MASK(rest == 0.0f)), b.t1);
#endif
}

// The gradient of the raw value in index units: by central differences, or of the interpolant itself.
static inline Real3 surface_gradient(constant const View *view, VOLUME voxels, int analytic, Real3 at, Mask on) {
#if INTERPOLATION != INTERPOLATION_NEAREST
    if (analytic) {
        Real3 g;
        taps_raw(view, voxels, at, &g);
        return g;
    }
#endif
#if INTERPOLATION == INTERPOLATION_TRILINEAR
    float nx = (float)view->dims[0] - INNER_MARGIN, ny = (float)view->dims[1] - INNER_MARGIN, nz = (float)view->dims[2] - INNER_MARGIN;
    Mask inner = MASK(at.x > INNER_MARGIN) & MASK(at.x < nx) & MASK(at.y > INNER_MARGIN) & MASK(at.y < ny) & MASK(at.z > INNER_MARGIN) & MASK(at.z < nz);
    if (!any_lane(on & ~inner)) {
        Real3 g, middle = real3((Real)(0.5f * view->dims[0]), (Real)(0.5f * view->dims[1]), (Real)(0.5f * view->dims[2]));
        inner_gradient(view, voxels, inner_position(select3(middle, at, on)), &g);
        return scale3(g, (Real)(GRADIENT_UNIT));
    }
#endif
    return gradient_raw(view, voxels, at);
}

// The part of the sky over the surface that other surfaces hide within the radius, by rays with the cosine's density (Zhukov, Iones, Kronin, "An
// Ambient Light Illumination Model", Rendering Techniques 1998). Clipped-away surfaces hide nothing.
static inline Real occlusion(constant const View *view, constant const Isosurface *params, VOLUME voxels, const Packet *p, const Bracket *b,
                             Real3 at, Real3 ray, Real3 gradient, Mask on) {
    Real squared = dot3(gradient, gradient);
    on &= MASK(squared > view->flat_squared);
    // The normal towards the eye, and a frame around it (Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017).
    Real scale = copysign(rsqrt(select((Real)(1.0f), squared, on)), -dot3(gradient, ray));
    Real3 n = scale3(gradient, scale);
    Real sign = copysign((Real)(1.0f), n.z), a = -1.0f / (sign + n.z), c = n.x * n.y * a;
    Real3 s = real3(mad(sign * n.x, n.x * a, (Real)(1.0f)), sign * c, -sign * n.x), t = real3(c, mad(n.y, n.y * a, sign), -n.y);
    Mask below = MASK(b->f0 < 0.0f);
    constant const float *m = view->world_gradient_from_index;
    #define INDEX(v) real3(mad(m[0], v.x, mad(m[3], v.y, m[6] * v.z)), mad(m[1], v.x, mad(m[4], v.y, m[7] * v.z)), mad(m[2], v.x, mad(m[5], v.y, m[8] * v.z)))
    Real3 from = along(at, INDEX(n), (Real)(params->occlusion_start));
    Real hidden = (Real)(0.0f);
    for (int i = 0; i < params->occlusion_rays; i++) {
        UInt4Lanes ctr = {p->pixel, as_UInt(p->sample), (UInt)(1u + i), (UInt)(view->stream)};
        UInt4Lanes u = philox(ctr, view->seed[0], view->seed[1]);
        Real turn = 6.2831853f * unit_open(u.a), r2 = unit_open(u.b), r = sqrt(r2), up = sqrt(1.0f - r2);
        Real x = r * cos(turn), y = r * sin(turn);
        Real3 w = real3(mad(s.x, x, mad(t.x, y, n.x * up)), mad(s.y, x, mad(t.y, y, n.y * up)), mad(s.z, x, mad(t.z, y, n.z * up)));
        Ray over = {from, INDEX(w), (Real)(0.0f), (Real)(params->occlusion_radius)};
        clip_box(view, 0.0f, &over);
        for (int j = 0; j < view->planes; j++) clip_plane(view->plane_index + 4 * j, &over);
        Mask open = on;
        for (Real l = view->step * unit_open(u.c);; l += view->step) {
            open &= MASK(l < over.t_far);
            if (!any_lane(open)) break;
            Real f = sample_raw(view, voxels, along(over.origin, over.direction, l)) - b->isovalue;
            Mask other = (below ^ MASK(f < 0.0f)) & MASK(f == f) & MASK(l >= over.t_near) & open;
            hidden += select((Real)(0.0f), (Real)(1.0f), other);
            open &= ~other;
        }
    }
    #undef INDEX
    return hidden / (float)params->occlusion_rays;
}

#endif
