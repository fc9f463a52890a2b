// The places of samples in their pixel. `Places` of src/run/places.rs gives the reason; the host has the same numbers.
#ifndef SHARED_PLACES_H
#define SHARED_PLACES_H

#include "shared/lanes.h"
#include "shared/rng.h"

// The steps of the R2 sequence, in units of 2^-32.
#define R2_STEP_U 0xc13fa9a9u
#define R2_STEP_V 0x91e10da6u
// Samples before the quarter turns, if all pixels share their places.
#define FIRST_PLACES 4

// The offset of a sample that all pixels share.
static inline float2 sample_offset(constant const View *view, uint sample) {
    if (sample < FIRST_PLACES) return (float2)(view->first_places[2 * sample], view->first_places[2 * sample + 1]);
    float u = ((float)((sample / 4u * R2_STEP_U + view->place_shift[0]) >> 9) + 0.5f) * 0x1p-24f - 0.5f;
    float v = ((float)((sample / 4u * R2_STEP_V + view->place_shift[1]) >> 9) + 0.5f) * 0x1p-24f - 0.5f;
    float2 turned = sample % 4u < 2u ? (float2)(u, v) : (float2)(-v, u);
    return 0.5f + (sample % 2u ? -turned : turned);
}

// Random numbers of places are apart from those of steps and of rays by this dimension.
#define PLACE_DIMENSION 0x70616365u

// The offset of each lane's sample, if each pixel has a shift of its own: a point of R2 and its turns by quarters.
static inline void own_offsets(constant const View *view, UInt pixel, Int sample, Real *x, Real *y) {
    UInt4Lanes ctr = {pixel, (UInt)(0u), (UInt)(PLACE_DIMENSION), (UInt)(view->stream)};
    UInt4Lanes shift = philox(ctr, view->seed[0], view->seed[1]);
    UInt group = as_UInt(sample >> 2);
    Real u = (to_real(as_Int((group * R2_STEP_U + shift.a) >> 9)) + 0.5f) * 0x1p-24f - 0.5f;
    Real v = (to_real(as_Int((group * R2_STEP_V + shift.b) >> 9)) + 0.5f) * 0x1p-24f - 0.5f;
    Mask by_quarter = MASK((sample & 2) != 0), opposite = MASK((sample & 1) != 0);
    Real turned_x = select(u, -v, by_quarter), turned_y = select(v, u, by_quarter);
    *x = 0.5f + select(turned_x, -turned_x, opposite);
    *y = 0.5f + select(turned_y, -turned_y, opposite);
}

// The pixel, the sample and the image point, in full-size pixels, of a place in the film of a pass.
typedef struct { UInt pixel; Int sample; Real x, y; } Spot;

// In the film of a probe, the samples of one pixel lie side by side, and pixels in clusters.
static inline Spot spot_at(constant const View *view, Int film_column, Int film_row) {
    int across = view->batch[0], down = view->batch[1], cluster = view->cluster, within = (1 << cluster) - 1;
    Int x_number = film_column >> across, y_number = film_row >> down;
    Int column = (x_number >> cluster) * view->stride + (x_number & within), row = (y_number >> cluster) * view->stride + (y_number & within);
    Spot s;
    s.sample = view->sample + (film_column & ((1 << across) - 1)) + ((film_row & ((1 << down) - 1)) << across);
    s.pixel = as_UInt(row * view->full_width + column);
    Real x = (Real)(view->offset[0]), y = (Real)(view->offset[1]);
    if (view->own_places) own_offsets(view, s.pixel, s.sample, &x, &y);
    s.x = to_real(column) + x, s.y = to_real(row) + y;
    return s;
}

#endif
