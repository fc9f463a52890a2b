// Styles of samples beyond the transfer function: opacity by gradient and by angle, colour by curvature, light by tone and through thin tissue. All
// of them work per sample, so they hold for any interpolation.
#ifndef SHARED_STYLE_H
#define SHARED_STYLE_H

#include "shared/curvature.h"
#include "shared/lanes.h"
#include "shared/shade.h"
#include "shared/volume.h"

#if STYLED
typedef struct { Real3 gradient, slope, normal, ray; Real magnitude, facing; Mask flat; Curvature bend; } Surface;

// The surface through p: `gradient` in raw values per world unit, `slope` in raw values per voxel, `normal` towards lower values, `facing` = |normal . ray|.
static inline Surface surface_at(constant const View *view, constant const EmissionAbsorption *params, VOLUME voxels, Real3 p,
                                 Real3 ray, Real *raw) {
    Surface s;
    if (params->curvature_full > 0.0f) {
        Jet jet = b_spline_jet(view, voxels, p);
        *raw = jet.value;
        s.slope = jet.gradient, s.gradient = gradient_world(view, s.slope);
        s.bend = curvature(view, s.gradient, congruent(view->world_gradient_from_index, jet.hessian));
    } else {
        *raw = sample_raw(view, voxels, p);
        s.slope = gradient_raw(view, voxels, p), s.gradient = gradient_world(view, s.slope);
    }
    Real squared = dot3(s.gradient, s.gradient);
    s.flat = MASK(!(squared > view->flat_squared));
    s.magnitude = select(sqrt(squared), (Real)(0.0f), s.flat);
    s.normal = scale3(s.gradient, select(-rsqrt(squared), (Real)(0.0f), s.flat));
    s.ray = ray;
    s.facing = fabs(dot3(s.normal, ray));
    return s;
}

// The factor of the transfer function's extinction: by |gradient| over the reference (Levoy, IEEE CG&A 8(3), 1988), and at silhouettes by base + gain
// (1 - |n . v|)^exponent (Ebert & Rheingans, IEEE Visualization 2000).
static inline Real extinction_factor(constant const EmissionAbsorption *params, const Surface *s) {
    Real factor = (Real)(1.0f);
    if (params->gradient_gain > 0.0f) factor = s->magnitude * params->gradient_gain;
    if (params->silhouette_gain > 0.0f) {
        Real edge_on = select(1.0f - s->facing, (Real)(0.0f), s->flat);
        Real edge = exp2(params->silhouette_exponent * log2(fmax(edge_on, (Real)(1e-6f))));
        factor *= mad(edge, (Real)(params->silhouette_gain), (Real)(params->silhouette_base));
    }
    return factor;
}

static inline Real3 mix3(Real3 a, constant const float *b, Real f) {
    return real3(mad(b[0] - a.x, f, a.x), mad(b[1] - a.y, f, a.y), mad(b[2] - a.z, f, a.z));
}

// Ridges and valleys in colours of their own, and contours of an even width: dark where |n . v| <= sqrt(w k (2 - w k)), k the
// curvature along the ray and w the width in world units (Kindlmann 2003, section 5).
static inline Real3 colour_by_curvature(constant const EmissionAbsorption *params, const Surface *s, Real3 colour) {
    Real ridge = clamp(s->bend.first / params->curvature_full, (Real)(0.0f), (Real)(1.0f));
    Real valley = clamp(-s->bend.second / params->curvature_full, (Real)(0.0f), (Real)(1.0f));
    colour = mix3(mix3(colour, params->ridge, ridge), params->valley, valley);
    if (params->contour_width > 0.0f) {
        Real along_normal = dot3(s->normal, s->ray);
        Real3 tangent = real3(s->ray.x - along_normal * s->normal.x, s->ray.y - along_normal * s->normal.y, s->ray.z - along_normal * s->normal.z);
        Real bend = dot3(tangent, times(s->bend.normal_change, tangent)) / fmax(dot3(tangent, tangent), (Real)(1e-12f));
        Real wk = clamp(params->contour_width * bend, (Real)(0.0f), (Real)(1.0f));
        Mask contour = MASK(s->facing * s->facing < wk * (2.0f - wk)) & ~s->flat;
        colour = select3(colour, real3((Real)(0.0f), (Real)(0.0f), (Real)(0.0f)), contour);
    }
    return colour;
}

// Cool to warm by the angle to the light instead of dark to bright (Gooch, Gooch, Shirley, Cohen, SIGGRAPH 1998):
// (1 + n.l)/2 (warm + colour/2) + (1 - n.l)/2 (cool + colour/4).
static inline Real3 tone(constant const View *view, constant const EmissionAbsorption *params, const Surface *s, Real3 colour) {
    constant const float *l = view->light_direction, *cool = params->cool, *warm = params->warm;
    Real f = 0.5f + 0.5f * mad(s->normal.x, l[0], mad(s->normal.y, l[1], s->normal.z * l[2]));
    return real3(mad(f, warm[0] + 0.5f * colour.x, (1.0f - f) * (cool[0] + 0.25f * colour.x)),
                 mad(f, warm[1] + 0.5f * colour.y, (1.0f - f) * (cool[1] + 0.25f * colour.y)),
                 mad(f, warm[2] + 0.5f * colour.z, (1.0f - f) * (cool[2] + 0.25f * colour.z)));
}

// Light on a thin sheet that transmits the part t: a light on the eye's side counts (1 - t), a light behind t. The lobe of the latter is Blinn's for
// the light mirrored to the eye's side: h = normalise(l - 2 (n.l) n + v), (n.h)^exponent.
static inline Real3 shade_translucent(constant const View *view, constant const EmissionAbsorption *params, const Surface *s, Real3 colour) {
    Real3 n = s->normal, body = real3(view->ambient, view->ambient, view->ambient), shine = real3(0.0f, 0.0f, 0.0f);
    Mask towards = MASK(dot3(n, s->ray) > 0.0f);
    n = select3(n, scale3(n, (Real)(-1.0f)), towards);
    for (int i = 0; i < view->lights; i++) {
        constant const float *d = view->light_direction + 3 * i, *lambert = view->lambert + 3 * i, *highlight = view->highlight + 3 * i;
        Real facing = mad(n.x, d[0], mad(n.y, d[1], n.z * d[2]));
        Mask behind = MASK(facing < 0.0f);
        Real mirror = select((Real)(0.0f), -2.0f * facing, behind);
        Real3 h = real3(d[0] + mirror * n.x - s->ray.x, d[1] + mirror * n.y - s->ray.y, d[2] + mirror * n.z - s->ray.z);
        Real along_half = clamp(dot3(n, h) * rsqrt(fmax(dot3(h, h), (Real)(1e-12f))), (Real)(1e-6f), (Real)(1.0f));
        Real exponent = select((Real)(view->shininess), (Real)(params->translucency_exponent), behind);
        Real share = select((Real)(1.0f - params->translucency), (Real)(params->translucency), behind);
        Real diffuse = share * select(fabs(facing), (Real)(1.0f), s->flat);
        Real glint = select(share * exp2(exponent * log2(along_half)), (Real)(0.0f), s->flat);
        body = real3(mad(diffuse, lambert[0], body.x), mad(diffuse, lambert[1], body.y), mad(diffuse, lambert[2], body.z));
        shine = real3(mad(glint, highlight[0], shine.x), mad(glint, highlight[1], shine.y), mad(glint, highlight[2], shine.z));
    }
    return real3(mad(colour.x, body.x, shine.x), mad(colour.y, body.y, shine.y), mad(colour.z, body.z, shine.z));
}

// The sample's colour in its light.
static inline Real3 styled_colour(constant const View *view, constant const EmissionAbsorption *params, const Surface *s, Real3 colour) {
    if (params->curvature_full > 0.0f) colour = colour_by_curvature(params, s, colour);
    if (params->toned) return tone(view, params, s, colour);
    if (params->translucency > 0.0f) return shade_translucent(view, params, s, colour);
    if (params->lit) {
        Real3 half_way[MAX_LIGHTS];
        half_ways(view, s->ray, half_way);
        return shade(view, s->slope, 1.0f, half_way, colour);
    }
    return colour;
}
#endif

#endif
