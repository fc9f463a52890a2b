// Pixels of a film in lanes: LANES neighbours of a row at a time, and their sRGB bytes.

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
    Real v0 = JOIN(vload, LANES)(0, from), v1 = JOIN(vload, LANES)(1, from);
    Real v2 = JOIN(vload, LANES)(2, from), v3 = JOIN(vload, LANES)(3, from);
    *alpha = EACH(3, 7, b, f);
    return real3(EACH(0, 4, 8, c), EACH(1, 5, 9, d), EACH(2, 6, a, e));
}
#endif

static inline Real luminances(Real3 c) { return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z; }

// One number a pixel.
static inline Real load_reals(global const float *from, int pixel) {
#if LANES == 1
    return from[pixel];
#else
    return JOIN(vload, LANES)(0, from + pixel);
#endif
}

// What is finite; an m2 is never negative.
static inline Mask known(Real m2) { return MASK(m2 <= FLT_MAX); }

// sRGB of linear values, by a table of 2^16 steps from 0 to 1 (`curve` of src/device/develop.rs); no number is 0.
static inline Int srgb(global const uchar *curve, Real v) {
#pragma OPENCL FP_CONTRACT OFF
    v = v > 0.0f ? v : (Real)(0.0f);
    v = v < 1.0f ? v : (Real)(1.0f);
    Real scaled = v * 65535.0f;
    return gather_words(curve, to_int(scaled + 0.5f)) & 255;
}

// How many of `lanes` have a value above white.
static inline int count_clipped(Real3 c, Mask lanes) {
    return count_lanes(MASK(c.x > 1.0f) & lanes) + count_lanes(MASK(c.y > 1.0f) & lanes) + count_lanes(MASK(c.z > 1.0f) & lanes);
}

typedef union { Int v; uchar4 lane[LANES]; } ByteLanes;

// Writes the bytes of pixels of a row, of which `inside` are the picture's.
static inline void store_bytes(constant Develop *d, global uchar *picture, int at, int inside, Int bytes) {
    ByteLanes lanes;
    lanes.v = bytes;
    for (int i = 0; i < LANES; i++) {
        if (i >= inside) break;
        if (d->transparent)
            vstore4(lanes.lane[i], at + i, picture);
        else
            vstore3(lanes.lane[i].xyz, at + i, picture);
    }
}

// The bytes of pixels: three each over the background, or four with an alpha that is not multiplied into them. Adds to `clipped` how many
// values of `lanes` were.
static inline Int picture_bytes(constant Develop *d, global const uchar *curve, Real3 colour, Real alpha, Mask lanes, int *clipped) {
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
