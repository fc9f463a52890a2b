// Light on a gradient: two-sided Lambert and Blinn-Phong (Blinn, SIGGRAPH 1977), with lights from infinity.
#ifndef SHARED_SHADE_H
#define SHARED_SHADE_H

#include "shared/lanes.h"

#define MAX_LIGHTS 4

// The gradient in the world from the one in index units: a covector.
static inline Real3 gradient_world(constant const View *view, Real3 g) {
    constant const float *m = view->world_gradient_from_index;
    return real3(mad(m[0], g.x, mad(m[1], g.y, m[2] * g.z)), mad(m[3], g.x, mad(m[4], g.y, m[5] * g.z)),
                 mad(m[6], g.x, mad(m[7], g.y, m[8] * g.z)));
}

// Constants along a ray of unit direction `ray`: for each light the unit half vector, as a covector in index units. Its product with a gradient in
// index units is that of the vectors in the world.
static inline void half_ways(constant const View *view, Real3 ray, Real3 half_way[MAX_LIGHTS]) {
    constant const float *m = view->world_gradient_from_index;
    for (int i = 0; i < view->lights; i++) {
        constant const float *d = view->light_direction + 3 * i;
        Real3 h = real3(d[0] - ray.x, d[1] - ray.y, d[2] - ray.z);
        h = scale3(h, rsqrt(fmax(dot3(h, h), (Real)(1e-12f))));
        half_way[i] = real3(mad(m[0], h.x, mad(m[3], h.y, m[6] * h.z)), mad(m[1], h.x, mad(m[4], h.y, m[7] * h.z)),
                            mad(m[2], h.x, mad(m[5], h.y, m[8] * h.z)));
    }
}

// The squared magnitude in the world of a gradient in index units.
static inline Real gradient_squared(constant const View *view, Real3 g) {
    if (view->isotropic_squared > 0.0f) return dot3(g, g) * view->isotropic_squared;
    Real3 n = gradient_world(view, g);
    return dot3(n, n);
}

// `colour` lit on the gradient g, in `unit` per voxel. A flat field has no surface to turn towards the light: full diffuse, no highlight.
static inline Real3 shade(constant const View *view, Real3 g, float unit, const Real3 half_way[MAX_LIGHTS], Real3 colour) {
    Real squared = gradient_squared(view, g);
    Mask flat = MASK(!(squared > view->flat_squared * (1.0f / (unit * unit))));
    Real scale = select(inverse_root(squared), (Real)(0.0f), flat);
    Real3 body = real3(view->ambient, view->ambient, view->ambient), shine = real3(0.0f, 0.0f, 0.0f);
    for (int i = 0; i < view->lights; i++) {
        constant const float *d = view->light_index + 3 * i, *lambert = view->lambert + 3 * i, *highlight = view->highlight + 3 * i;
        Real facing = select(fabs(mad(g.x, d[0], mad(g.y, d[1], g.z * d[2]))) * scale, (Real)(1.0f), flat);
        Real glint = power(fmin(fabs(dot3(g, half_way[i])) * scale, (Real)(1.0f)), view->shininess);
        body = real3(mad(facing, lambert[0], body.x), mad(facing, lambert[1], body.y), mad(facing, lambert[2], body.z));
        shine = real3(mad(glint, highlight[0], shine.x), mad(glint, highlight[1], shine.y), mad(glint, highlight[2], shine.z));
    }
    return real3(mad(colour.x, body.x, shine.x), mad(colour.y, body.y, shine.y), mad(colour.z, body.z, shine.z));
}

#endif
