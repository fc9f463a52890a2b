// Pixels of a film in lanes: LANES neighbours of a row at a time, and their sRGB bytes.
#ifndef SHARED_PIXELS_H
#define SHARED_PIXELS_H

#include "shared/lanes.h"
#include "shared/luminance.h"

// Linear, premultiplied colour and alpha of the pixels from `pixel` on: interleaved in memory, four numbers each.
#if LANES == 1
static inline Real3 load_pixels(global const float *film, int pixel, Real *alpha) {
    float4 p = vload4(pixel, film);
    *alpha = p.w;
    return real3(p.x, p.y, p.z);
}
#else
#if LANES == 16
#define PART(v, a, b, c, d) v.s##a##b##c##d
#elif LANES == 8
#define PART(v, a, b, c, d) v.s##a##b
#else
#define PART(v, a, b, c, d) v.s##a
#endif
#define EACH(a, b, c, d) ((Real)(PART(v0, a, b, c, d), PART(v1, a, b, c, d), PART(v2, a, b, c, d), PART(v3, a, b, c, d)))
static inline Real3 load_pixels(global const float *film, int pixel, Real *alpha) {
    global const float *from = film + 4 * pixel;
    Real v0 = REALS_AT(from), v1 = REALS_AT(from + LANES), v2 = REALS_AT(from + 2 * LANES), v3 = REALS_AT(from + 3 * LANES);
    *alpha = EACH(3, 7, b, f);
    return real3(EACH(0, 4, 8, c), EACH(1, 5, 9, d), EACH(2, 6, a, e));
}
#endif

// One number per pixel.
static inline Real load_reals(global const float *from, int pixel) {
#if LANES == 1
    return from[pixel];
#else
    return REALS_AT(from + pixel);
#endif
}

// The lanes with a finite m2, which is never negative.
static inline Mask known(Real m2) { return MASK(m2 <= FLT_MAX); }

// sRGB of linear values, by a table of 2^16 steps from 0 to 1 (`curve` of src/device/encode.rs); 0 for NaN.
static inline Int srgb(global const uchar *curve, Real v) {
#pragma OPENCL FP_CONTRACT OFF
    v = v > 0.0f ? v : (Real)(0.0f);
    v = v < 1.0f ? v : (Real)(1.0f);
    Real scaled = v * 65535.0f;
    return gather_words(curve, to_int(scaled + 0.5f)) & 255;
}

// The number of values above white in `lanes`.
static inline int count_clipped(Real3 c, Mask lanes) {
    return count_lanes(MASK(c.x > 1.0f) & lanes) + count_lanes(MASK(c.y > 1.0f) & lanes) + count_lanes(MASK(c.z > 1.0f) & lanes);
}

typedef union { Int v; uchar4 lane[LANES]; uchar16 four[LANES < 4 ? 1 : LANES / 4]; } ByteLanes;
typedef struct __attribute__((packed)) { uchar16 bytes; } Unaligned16;
typedef struct __attribute__((packed)) { uint2 words; } Unaligned8;
typedef struct __attribute__((packed)) { uint word; } Unaligned4;

// Writes the bytes of pixels of a row, of which `inside` are the picture's.
static inline void store_bytes(constant Encode *d, global uchar *picture, int at, int inside, Int bytes) {
    ByteLanes lanes;
    lanes.v = bytes;
#if LANES > 1
    if (!d->transparent && inside >= LANES) {
        // Four pixels are three words. Each store writes four words, and the next pixels overwrite the last one.
        global uchar *to = picture + 3 * at;
        for (int i = 0; i < LANES / 4; i++, to += 12) {
            uchar16 v = lanes.four[i], three = __builtin_shufflevector(v, v, 0, 1, 2, 4, 5, 6, 8, 9, 10, 12, 13, 14, -1, -1, -1, -1);
            if (i + 1 < LANES / 4) {
                ((global Unaligned16 *)to)->bytes = three;
            } else {
                uint4 words = as_uint4(three);
                ((global Unaligned8 *)to)->words = words.lo;
                ((global Unaligned4 *)(to + 8))->word = words.z;
            }
        }
        return;
    }
#endif
    for (int i = 0; i < LANES; i++) {
        if (i >= inside) break;
        if (d->transparent)
            vstore4(lanes.lane[i], at + i, picture);
        else
            vstore3(lanes.lane[i].xyz, at + i, picture);
    }
}

// The bytes of pixels: three each over the background, or four with an alpha that is not multiplied into them. Adds the number of clipped values of
// `lanes` to `clipped`.
static inline Int picture_bytes(constant Encode *d, global const uchar *curve, Real3 colour, Real alpha, Mask lanes, int *clipped) {
#pragma OPENCL FP_CONTRACT OFF
    Int last = (Int)(0);
    if (d->transparent) {
        Real scale = alpha > 0.0f ? 1.0f / alpha : (Real)(0.0f);
        colour = scale3(colour, scale);
        Real covered = alpha > 0.0f ? alpha : (Real)(0.0f);
        covered = covered < 1.0f ? covered : (Real)(1.0f);
        Real scaled = covered * 255.0f;
        last = to_int(scaled + 0.5f);
    } else {
        Real through = 1.0f - alpha;
        Real red = through * d->behind[0], green = through * d->behind[1], blue = through * d->behind[2];
        colour = real3(colour.x + red, colour.y + green, colour.z + blue);
    }
    *clipped += count_clipped(colour, lanes);
    return srgb(curve, colour.x) | srgb(curve, colour.y) << 8 | srgb(curve, colour.z) << 16 | last << 24;
}

#endif
