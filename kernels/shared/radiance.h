// The radiance that a ray has gathered, and the compositing of samples behind it.
#ifndef SHARED_RADIANCE_H
#define SHARED_RADIANCE_H

#include "shared/lanes.h"
#include "shared/optical.h"

typedef struct { Real3 colour; Real transmittance; } Radiance;

// The weight of a sample behind all earlier ones, in the lanes whose ray has not ended. Lowers the transmittance.
static inline Real weight_of(constant const EmissionAbsorption *params, Real alpha, Radiance *r) {
    Real weight = select((Real)(0.0f), r->transmittance * alpha, MASK(r->transmittance > params->transmittance_floor));
    r->transmittance -= weight;
    return weight;
}

static inline void add_light(Real3 colour, Real weight, Radiance *r) {
    r->colour = real3(mad(colour.x, weight, r->colour.x), mad(colour.y, weight, r->colour.y), mad(colour.z, weight, r->colour.z));
}

// Puts a sample behind (or, back to front, before) the earlier ones, in the lanes whose ray has not ended.
static inline void composite(constant const EmissionAbsorption *params, Optical o, Radiance *r) {
#if BACK_TO_FRONT
    r->colour = add3(scale3(r->colour, 1.0f - o.alpha), scale3(o.colour, o.alpha));
    r->transmittance *= 1.0f - o.alpha;
#else
    add_light(o.colour, weight_of(params, o.alpha, r), r);
#endif
}

// The opacity for `times` the extinction: 1 - (1 - alpha)^times.
static inline Real opacity_times(Real alpha, Real times) {
    return select(1.0f - exp2(log2(1.0f - alpha) * times), (Real)(0.0f), MASK(times <= 0.0f));
}

#endif
