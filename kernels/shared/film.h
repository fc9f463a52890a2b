// The film: per pixel the mean of linear RGB and alpha over the samples, and M2, the sum of squared deviations of the luminance (Welford, "Note on a
// method for calculating corrected sums of squares and products", Technometrics 4, 1962: sums and sums of squares that do not cancel). Layout: 4
// floats per pixel, then one M2 per pixel. A sample that is not finite is taken as black and counted. Its pixel's M2 is NaN from then on: its error
// is not known.
#ifndef SHARED_FILM_H
#define SHARED_FILM_H

#include "shared/lanes.h"
#include "shared/luminance.h"

static inline void film_add(global float *film, global uint *counts, int pixel, int pixels, int sample, float4 colour) {
    float4 mean = sample ? vload4(pixel, film) : (float4)(0.0f);
    float m2 = sample ? film[4 * pixels + pixel] : 0.0f;
    if (!(isfinite(colour.x) && isfinite(colour.y) && isfinite(colour.z) && isfinite(colour.w))) {
        atomic_inc(&counts[COUNT_NON_FINITE]);
        colour = (float4)(0.0f);
        m2 = NAN;
    }
    float before = luminance(colour) - luminance(mean);
    mean += (colour - mean) / (float)(sample + 1);
    m2 += before * (luminance(colour) - luminance(mean));
    vstore4(mean, pixel, film);
    film[4 * pixels + pixel] = m2;
}

// Adds one sample of each of a packet's pixels.
static inline void film_packet(constant const View *view, global float *film, global uint *counts, Int column, Int row, Real3 colour,
                               Real alpha) {
    RealLanes red, green, blue, opacity;
    IntLanes x, y;
    red.v = colour.x, green.v = colour.y, blue.v = colour.z, opacity.v = alpha;
    x.v = column, y.v = row;
    for (int i = 0; i < LANES; i++)
        if (x.lane[i] < view->width && y.lane[i] < view->height)
            film_add(film, counts, y.lane[i] * view->width + x.lane[i], view->width * view->height, view->held,
                     (float4)(red.lane[i], green.lane[i], blue.lane[i], opacity.lane[i]));
}

#endif
