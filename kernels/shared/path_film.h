// The end of paths on the film: bright samples are clamped if the request asks for it, and fireflies are counted.
#ifndef SHARED_PATH_FILM_H
#define SHARED_PATH_FILM_H

#include "shared/film.h"
#include "shared/lanes.h"

// A sample is a firefly if it brings more than twice the light of all that its pixel has had before.
#define FIREFLY_FROM 16
static inline int firefly(global const float *film, int pixel, int samples, float4 colour) {
    float mean = luminance(vload4(pixel, film));
    return mean > 0.0f && luminance(colour) > 2.0f * (float)samples * mean;
}

// Adds the paths in `done` to the film: the next sample of their pixels.
static inline void finish(constant const View *view, constant const Scattering *params, global float *film, global uint *counts, uint sample,
                          Int at, Mask done, Real3 light, Real alpha) {
    RealLanes red, green, blue, opacity;
    IntLanes pixel, on;
    if (params->clamp_luminance > 0.0f) {
        Real y = mad((Real)(0.2126f), light.x, mad((Real)(0.7152f), light.y, 0.0722f * light.z));
        Mask bright = done & MASK(y > params->clamp_luminance);
        if (any_lane(bright)) {
            atomic_add(&counts[COUNT_CLAMPED], (uint)count_lanes(bright));
            RealLanes taken;
            taken.v = select((Real)(0.0f), fmin(y / params->clamp_luminance - 1.0f, (Real)(1e9f)), bright);
            for (int i = 0; i < LANES; i++)
                if (taken.lane[i] > 0.0f) atom_add((global ulong *)(counts + COUNT_CLAMPED_ENERGY_LOW), (ulong)(taken.lane[i] * 65536.0f));
            light = select3(light, scale3(light, params->clamp_luminance / y), bright);
        }
    }
    red.v = light.x, green.v = light.y, blue.v = light.z, opacity.v = alpha;
    pixel.v = at, on.v = done;
    int pixels = view->width * view->height;
    for (int i = 0; i < LANES; i++) {
        if (!on.lane[i]) continue;
        float4 colour = (float4)(red.lane[i], green.lane[i], blue.lane[i], opacity.lane[i]);
        if (sample >= FIREFLY_FROM && firefly(film, pixel.lane[i], (int)sample, colour)) atomic_inc(&counts[COUNT_FIREFLIES]);
        film_add(film, counts, pixel.lane[i], pixels, (int)sample, colour);
    }
}

#endif
