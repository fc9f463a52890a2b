// The reflectance of an interface for unpolarised light at cosine `cos_in`, with eta = index before / index after; *cos_out is the cosine behind it.
// The form of 1 - eta^2 sin^2 loses no digits at grazing incidence.
#ifndef SHARED_FRESNEL_H
#define SHARED_FRESNEL_H

#include "shared/lanes.h"

static inline Real fresnel(Real cos_in, Real eta, Real *cos_out) {
    Real squared = mad(eta * eta, cos_in * cos_in, 1.0f - eta * eta), out = sqrt(fmax(squared, (Real)(0.0f)));
    Real s = (eta * cos_in - out) / fmax(mad(eta, cos_in, out), (Real)(1e-30f));
    Real p = (cos_in - eta * out) / fmax(mad(eta, out, cos_in), (Real)(1e-30f));
    *cos_out = out;
    return select(0.5f * mad(s, s, p * p), (Real)(1.0f), MASK(squared <= 0.0f));
}

#endif
