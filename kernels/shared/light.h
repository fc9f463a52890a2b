// Lights of a scene: LIGHT_NUMBERS floats each in the table,
//   kind, probability to be chosen, colour (3), position or direction towards it (3), radius or cosine (1), edges (3 + 3)
//   LIGHT_SUN     irradiance of a face towards it; direction; 1 - the cosine of its angular radius, 0 for a point at infinity
//   LIGHT_POINT   intensity; position
//   LIGHT_SPHERE  radiance of its outside; position, radius
//   LIGHT_QUAD    radiance of both sides; corner, edges
// The sky's radiance is interpolated from its zenith to its horizon. Lights do not hide each other, nor anything else.
#ifndef SHARED_LIGHT_H
#define SHARED_LIGHT_H

#include "shared/lanes.h"
#include "shared/phase.h"

#define TURN 6.28318531f

static inline Real magnitude(Real3 c) { return fmax(fabs(c.x), fmax(fabs(c.y), fabs(c.z))); }
static inline void add_light(Real3 *sum, Real3 light, Mask on) { *sum = select3(*sum, add3(*sum, light), on); }

typedef struct { Int kind; Real chance; Real3 colour, position; Real size; Real3 u, v; } Light;

static inline Light light_of(constant const Scattering *params, global const float *table, Int which) {
    Light l;
    global const float *from = table + params->at_lights;
    Int at = which * LIGHT_NUMBERS;
    // One light needs no gathers.
    #define NUMBER(i) (params->lights == 1 ? (Real)(from[i]) : gather_reals(from + (i), at))
    l.kind = to_int(NUMBER(0)), l.chance = NUMBER(1);
    l.colour = real3(NUMBER(2), NUMBER(3), NUMBER(4)), l.position = real3(NUMBER(5), NUMBER(6), NUMBER(7)), l.size = NUMBER(8);
    l.u = real3(NUMBER(9), NUMBER(10), NUMBER(11)), l.v = real3(NUMBER(12), NUMBER(13), NUMBER(14));
    #undef NUMBER
    return l;
}

// The light that the number u chooses.
static inline Int choose_light(constant const Scattering *params, global const float *table, Real u) {
    Int which = (Int)(0);
    float below = 0.0f;
    for (int i = 0; i + 1 < params->lights; i++) {
        below += table[params->at_lights + i * LIGHT_NUMBERS + 1];
        which -= MASK(u >= below);
    }
    return which;
}

static inline Real3 minus3(Real3 a, Real3 b) { return real3(a.x - b.x, a.y - b.y, a.z - b.z); }
static inline Real3 cross3(Real3 a, Real3 b) {
    return real3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
static inline Real3 times3(Real3 a, Real3 b) { return real3(a.x * b.x, a.y * b.y, a.z * b.z); }

// 1 - the cosine of the cone under which a sphere is seen from a squared distance; 2 (all directions) from inside it.
static inline Real cone_of(Real size, Real squared) {
    Real sine2 = size * size / fmax(squared, (Real)(1e-30f));
    return select(sine2 / (1.0f + sqrt(fmax(1.0f - sine2, (Real)(0.0f)))), (Real)(2.0f), MASK(sine2 >= 1.0f));
}

typedef struct { Real3 d; Real length; Real3 light; Real density; } LightRay; // per steradian; 0 if no ray meets the light by chance

// A ray from `at` towards a light by the numbers u and v: its light, divided by the density of the direction.
static inline LightRay light_ray(const Light *l, Real3 at, Real u, Real v) {
    LightRay ray;
    Mask sun = MASK(l->kind == LIGHT_SUN), sphere = MASK(l->kind == LIGHT_SPHERE), quad = MASK(l->kind == LIGHT_QUAD);
    Real3 aim_at = l->position;
    if (any_lane(quad)) aim_at = select3(aim_at, along(along(l->position, l->u, u), l->v, v), quad);
    Real3 to = select3(minus3(aim_at, at), l->position, sun);
    Real squared = fmax(dot3(to, to), (Real)(1e-30f)), inverse = rsqrt(squared);
    ray.d = scale3(to, inverse);
    ray.length = select(squared * inverse, (Real)(1e30f), sun);
    ray.light = select3(scale3(l->colour, inverse * inverse), l->colour, sun);
    ray.density = (Real)(0.0f);
    Mask disc = sphere | (sun & MASK(l->size > 0.0f));
    if (any_lane(disc)) {
        Real cone = select(l->size, cone_of(l->size, squared), sphere), one_minus = u * cone;
        ray.d = select3(ray.d, rotate_direction(ray.d, one_minus, 2.0f - one_minus, v), disc);
        // A sun's irradiance is its radiance times pi sin^2 of its angular radius.
        Real radiance = select((Real)(1.0f), 1.0f / (0.5f * TURN * l->size * (2.0f - l->size)), sun);
        ray.density = select(ray.density, 1.0f / (TURN * cone), disc);
        ray.light = select3(ray.light, scale3(l->colour, radiance * TURN * cone), disc);
        Real along_middle = dot3(minus3(l->position, at), ray.d), off2 = squared - along_middle * along_middle;
        Real half_chord = sqrt(fmax(l->size * l->size - off2, (Real)(0.0f)));
        ray.length = select(ray.length, fmax(along_middle - half_chord, (Real)(0.0f)), sphere);
        // Nothing shines inside a sphere.
        ray.light = select3(ray.light, real3((Real)(0.0f), (Real)(0.0f), (Real)(0.0f)), sphere & MASK(cone >= 2.0f));
    }
    if (any_lane(quad)) {
        Real3 normal = cross3(l->u, l->v); // as long as the area
        Real facing = fabs(dot3(normal, ray.d));
        ray.density = select(ray.density, squared / fmax(facing, (Real)(1e-20f)), quad);
        ray.light = select3(ray.light, scale3(l->colour, facing / squared), quad);
    }
    return ray;
}

// The light of the lights that a ray from `at` meets between the lengths `from` and `to`, each weighed against the chance that next-event estimation
// aimed at it: the balance heuristic (Veach & Guibas, SIGGRAPH 1995), density / (density + chance * its own). Without `weighed` each light counts
// fully. If every light is aimed at in its turn (`each`) the chance is 1.
static inline Real3 met(constant const Scattering *params, global const float *table, Real3 at, Real3 d, Real from, Real to, Real density,
                        Mask weighed, int each) {
    Real3 sum = real3((Real)(0.0f), (Real)(0.0f), (Real)(0.0f));
    for (int i = 0; i < params->lights; i++) {
        global const float *l = table + params->at_lights + i * LIGHT_NUMBERS;
        int kind = (int)l[0];
        Real own, length, radiance = (Real)(1.0f);
        Mask seen;
        Real3 to_light = real3(l[5] - at.x, l[6] - at.y, l[7] - at.z);
        if (kind == LIGHT_SUN) {
            if (!(l[8] > 0.0f)) continue;
            // |d - axis|^2 / 2 = 1 - cosine, without loss of digits for a small disc
            Real3 off = real3(d.x - l[5], d.y - l[6], d.z - l[7]);
            seen = MASK(0.5f * dot3(off, off) <= l[8]);
            length = (Real)(1e29f);
            own = (Real)(1.0f / (TURN * l[8]));
            radiance = (Real)(1.0f / (0.5f * TURN * l[8] * (2.0f - l[8])));
        } else if (kind == LIGHT_SPHERE) {
            Real squared = dot3(to_light, to_light), along_d = dot3(to_light, d);
            Real3 off = minus3(to_light, scale3(d, along_d));
            Real chord2 = (Real)(l[8] * l[8]) - dot3(off, off);
            // A flight that began before `at` may have met the light there.
            seen = MASK(chord2 > 0.0f) & (MASK(squared > l[8] * l[8]) | MASK(from < 0.0f));
            length = along_d - sqrt(fmax(chord2, (Real)(0.0f)));
            own = 1.0f / (TURN * cone_of((Real)(l[8]), squared));
        } else if (kind == LIGHT_QUAD) {
            float3 u = (float3)(l[9], l[10], l[11]), v = (float3)(l[12], l[13], l[14]), n = cross(u, v);
            Real facing = mad(n.x, d.x, mad(n.y, d.y, n.z * d.z)), safe = select(facing, (Real)(1e-20f), MASK(fabs(facing) < 1e-20f));
            length = mad(n.x, to_light.x, mad(n.y, to_light.y, n.z * to_light.z)) / safe;
            Real3 on = minus3(scale3(d, length), to_light);
            // The light's two coordinates, by the reciprocal vectors of the edges.
            float area2 = dot(n, n);
            float3 ru = cross(v, n) / area2, rv = cross(n, u) / area2;
            Real a = mad(ru.x, on.x, mad(ru.y, on.y, ru.z * on.z)), b = mad(rv.x, on.x, mad(rv.y, on.y, rv.z * on.z));
            seen = MASK(a >= 0.0f) & MASK(a <= 1.0f) & MASK(b >= 0.0f) & MASK(b <= 1.0f) & MASK(fabs(facing) > 1e-20f);
            own = length * length / fmax(fabs(facing), (Real)(1e-20f));
        } else {
            continue;
        }
        seen &= MASK(length > from) & MASK(length <= to);
        if (!any_lane(seen)) continue;
        Real share = select((Real)(1.0f), density / (density + (each ? 1.0f : l[1]) * own), weighed);
        share = select((Real)(0.0f), share * radiance, seen);
        sum = real3(mad(share, l[2], sum.x), mad(share, l[3], sum.y), mad(share, l[4], sum.z));
    }
    return sum;
}

// The sky's radiance in a direction.
static inline Real3 sky_of(constant const Scattering *params, Real3 d) {
    constant const float *z = params->sky_zenith, *h = params->sky_horizon, *g = params->sky_ground;
    Real height = mad(params->sky_up[0], d.x, mad(params->sky_up[1], d.y, params->sky_up[2] * d.z));
    Real up = clamp(height, (Real)(0.0f), (Real)(1.0f)), down = clamp(-height, (Real)(0.0f), (Real)(1.0f));
    #define MIX(i) mad(down, (Real)(g[i] - h[i]), mad(up, (Real)(z[i] - h[i]), (Real)(h[i])))
    return real3(MIX(0), MIX(1), MIX(2));
    #undef MIX
}

#endif
