// The volume's faces, at which the refractive index changes. The transmitted quantity is radiance over the squared index.
#ifndef SHARED_SURFACE_H
#define SHARED_SURFACE_H

#include "shared/fresnel.h"
#include "shared/lanes.h"

// The unit normal of the faces across an axis of the volume, in the world.
static inline Real3 face_normal(constant const View *view, Int axis) {
    constant const float *w = view->world_gradient_from_index;
    Mask y = MASK(axis == 1), z = MASK(axis == 2);
    #define PART(row) select(select((Real)(w[3 * row]), (Real)(w[3 * row + 1]), y), (Real)(w[3 * row + 2]), z)
    Real3 n = real3(PART(0), PART(1), PART(2));
    #undef PART
    return scale3(n, rsqrt(dot3(n, n)));
}

// The lanes that a face turns back by the number u. The others' directions are refracted. eta is the index before over the one behind.
static inline Mask cross_face(constant const View *view, float eta, Int axis, Real u, Mask on, Real3 *d) {
    Real3 n = face_normal(view, axis);
    Real along_n = dot3(*d, n), cos_out, reflected = fresnel(fabs(along_n), (Real)(eta), &cos_out);
    Mask back = on & MASK(u < reflected);
    Real3 mirrored = along(*d, n, -2.0f * along_n);
    Real3 bent = along(scale3(*d, (Real)(eta)), n, copysign(cos_out, along_n) - eta * along_n);
    bent = scale3(bent, rsqrt(fmax(dot3(bent, bent), (Real)(1e-20f))));
    *d = select3(select3(*d, bent, on), mirrored, back);
    return back;
}

// The axis of the face that p is on.
static inline Int face_at(constant const View *view, Real3 p) {
    #define OFF(c, i) fmin(fabs(p.c), fabs(p.c - (float)view->dims[i]))
    Real x = OFF(x, 0), y = OFF(y, 1), z = OFF(z, 2);
    #undef OFF
    Int axis = select((Int)(0), (Int)(1), MASK(y < x));
    return select(axis, (Int)(2), MASK(z < fmin(x, y)));
}

#endif
