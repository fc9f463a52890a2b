// The places of samples in their pixel. `Places` of src/run/places.rs gives the reason; the host has the same numbers.
#ifndef SHARED_PLACES_H
#define SHARED_PLACES_H

#include "shared/lanes.h"
#include "shared/rng.h"

// Sobol's (0, 2)-sequence (USSR Comput. Math. Math. Phys. 7, 1967), each side with a nested uniform scramble (Owen 1995) by a hash: Burley, "Practical
// Hash-based Owen Scrambling", JCGT 9(4), 2020, with the hash of Vegdahl, "Building a Better LK Hash", 2021. A hash in which each bit depends on lower
// ones alone is such a scramble of the bits in reverse. In reverse the first side is the number itself, and the second one the sums, modulo 2, of its
// bits at all places of which Pascal's triangle has an odd number. For packets and for single numbers.
#define SCRAMBLED_SOBOL(T, POINT, SCRAMBLED) \
    static inline T SCRAMBLED(T v, T key) { \
        v ^= v * 0x3d20adeau; \
        v += key; \
        v *= (key >> 16) | 1u; \
        v ^= v * 0x05526c56u; \
        v ^= v * 0x53a22864u; \
        v = (v >> 16) | (v << 16); \
        v = ((v >> 8) & 0x00ff00ffu) | ((v & 0x00ff00ffu) << 8); \
        v = ((v >> 4) & 0x0f0f0f0fu) | ((v & 0x0f0f0f0fu) << 4); \
        v = ((v >> 2) & 0x33333333u) | ((v & 0x33333333u) << 2); \
        return ((v >> 1) & 0x55555555u) | ((v & 0x55555555u) << 1); \
    } \
    static inline void POINT(T number, T key_u, T key_v, T *u, T *v) { \
        *u = SCRAMBLED(number, key_u); \
        number ^= (number >> 1) & 0x55555555u; \
        number ^= (number >> 2) & 0x33333333u; \
        number ^= (number >> 4) & 0x0f0f0f0fu; \
        number ^= (number >> 8) & 0x00ff00ffu; \
        *v = SCRAMBLED(number ^ ((number >> 16) & 0xffffu), key_v); \
    }
SCRAMBLED_SOBOL(uint, shared_point, shared_scrambled)
SCRAMBLED_SOBOL(UInt, own_point, own_scrambled)

// The samples whose places are bent, so that the mean after each power of two is the centre.
#define BENT_FROM 4u
#define BENT_TO 1024u

// The offset of a sample that all pixels share.
static inline float2 sample_offset(constant const View *view, uint sample) {
    uint u, v;
    shared_point(sample, view->place_keys[0], view->place_keys[1], &u, &v);
    u ^= view->place_moves[u >> 30], v ^= view->place_moves[4u + (v >> 30)];
    float2 place = (float2)((float)(u >> 9) + 0.5f, (float)(v >> 9) + 0.5f) * 0x1p-23f;
    if (sample < BENT_FROM || sample >= BENT_TO) return place;
    uint octave = clz(BENT_FROM) - clz(sample);
    float2 bend = (float2)(view->place_bends[2u * octave], view->place_bends[2u * octave + 1u]);
    return place + bend * place * (1.0f - place);
}

// Random numbers of places are apart from those of steps and of rays by this dimension.
#define PLACE_DIMENSION 0x70616365u

// The offset of each lane's sample, if each pixel has places of its own.
static inline void own_offsets(constant const View *view, UInt pixel, Int sample, Real *x, Real *y) {
    UInt4Lanes ctr = {pixel, (UInt)(0u), (UInt)(PLACE_DIMENSION), (UInt)(view->stream)};
    UInt4Lanes keys = philox(ctr, view->seed[0], view->seed[1]);
    UInt u, v;
    own_point(as_UInt(sample), keys.a, keys.b, &u, &v);
    *x = (to_real(as_Int(u >> 9)) + 0.5f) * 0x1p-23f;
    *y = (to_real(as_Int(v >> 9)) + 0.5f) * 0x1p-23f;
}

// The pixel, the sample and the image point, in full-size pixels, of a place in the film of a pass.
typedef struct { UInt pixel; Int sample; Real x, y; } Spot;

// In the film of a probe, the samples of one pixel lie side by side, and pixels in clusters.
static inline Spot spot_at(constant const View *view, Int film_column, Int film_row) {
    int across = view->batch[0], down = view->batch[1], cluster = view->cluster, within = (1 << cluster) - 1;
    Int x_number = film_column >> across, y_number = film_row >> down;
    Int column = (x_number >> cluster) * view->stride + (x_number & within), row = (y_number >> cluster) * view->stride + (y_number & within);
    column += view->origin[0], row += view->origin[1];
    Spot s;
    s.sample = view->sample + (film_column & ((1 << across) - 1)) + ((film_row & ((1 << down) - 1)) << across);
    s.pixel = as_UInt(row * view->full_width + column);
    Real x = (Real)(view->offset[0]), y = (Real)(view->offset[1]);
    if (view->own_places) own_offsets(view, s.pixel, s.sample, &x, &y);
    s.x = to_real(column) + x, s.y = to_real(row) + y;
    return s;
}

#endif
