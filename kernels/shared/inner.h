// Samples of packets whose lanes are all at least INNER_MARGIN voxels away from the box's faces: no clamps. Positions come from inner_position, and
// values are in units of INNER_UNIT. Bytes and words are weighed in whole numbers. Their weights have 15 bits and sum to exactly 1: values are exact
// to some 2^-15 of their differences, and the same to the last bit for any number of lanes.
#ifndef SHARED_INNER_H
#define SHARED_INNER_H

#include "shared/lanes.h"
#include "shared/volume.h"

#define INNER_MARGIN 1.51f
// The unit, per voxel, of a gradient by central differences.
#define GRADIENT_UNIT (0.5f * INNER_UNIT)

#if INTERPOLATION == INTERPOLATION_TRILINEAR && VOXEL != VOXEL_F32 && !VOLUMES_ARE_IMAGES
#define INNER_WHOLE 1
#define INNER_UNIT (1.0f / 32767.0f)
// A position has 16 fractional bits.
#define INNER_SCALE 65536.0f
// Truncation takes half of the last bit off a position on average, and as much off half of its product with a weight.
#define INNER_ROUNDING 1.0f

#if VOXEL == VOXEL_U16
// Unsigned words are weighed as signed ones, half of their range below; WHOLE adds it again.
#define WORD_SIGNS ((int)0x80008000)
#define WHOLE(sum) to_real((sum) + 0x8000 * 0x7fff)
#else
#define WORD_SIGNS 0
#define WHOLE(sum) to_real(sum)
#endif

// Weights are words. One instruction multiplies and adds two of them: a register of lanes at AVX-512 and at AVX2.
#if LANES == 16 && defined(__AVX512BW__) && __has_builtin(__builtin_ia32_pmaddwd512)
#define WEIGHTS_ARE_WORDS 1
#define LEVEL_BUILTIN(name) JOIN(__builtin_ia32_##name, 512)
#define REPEATED(a, b, c, d) ((Int)(a, b, c, d, a, b, c, d, a, b, c, d, a, b, c, d))
#elif LANES == 8 && defined(__AVX2__) && __has_builtin(__builtin_ia32_pmaddwd256)
#define WEIGHTS_ARE_WORDS 1
#define LEVEL_BUILTIN(name) JOIN(__builtin_ia32_##name, 256)
#define REPEATED(a, b, c, d) ((Int)(a, b, c, d, a, b, c, d))
#endif

#if WEIGHTS_ARE_WORDS
typedef short Words __attribute__((ext_vector_type(2 * LANES)));
typedef char Bytes __attribute__((ext_vector_type(4 * LANES)));
typedef Words Weights; // the weights of two voxels side by side in x
#define AS_WORDS(v) __builtin_astype(v, Words)
#define SHUFFLE(v, order) __builtin_astype(LEVEL_BUILTIN(pshufb)(__builtin_astype(v, Bytes), __builtin_astype(order, Bytes)), Words)
#define MULTIPLY_ADD(a, b) __builtin_astype(LEVEL_BUILTIN(pmaddwd)(a, b), Int)
// The order that makes the bytes 0 and 1 of each lane two words.
#define PAIR_ORDER REPEATED(0x80018000, 0x80058004, 0x80098008, 0x800d800c)
// The low word of each lane in both, and the high one.
#define BOTH(v) SHUFFLE(v, REPEATED(0x01000100, 0x05040504, 0x09080908, 0x0d0c0d0c))
#define BOTH_HIGH(v) SHUFFLE(v, REPEATED(0x03020302, 0x07060706, 0x0b0a0b0a, 0x0f0e0f0e))

// The weights at the fraction of x.
static inline Weights weights_at(Int x) {
    // The pair (1 - f, f) as words.
    Int f = __builtin_astype(BOTH(x >> 1), Int);
#if LANES == 16
    return AS_WORDS(__builtin_ia32_pternlogd512_mask(f, (Int)(0x7fff7fff), (Int)(0x7fff), 0x6a, (short)-1));
#else
    return AS_WORDS((f & 0x7fff7fff) ^ 0x7fff);
#endif
}

// The part of the weights that the fraction of `position` gives to the farther of two voxels.
static inline Weights farther(Weights w, Int position) { return LEVEL_BUILTIN(pmulhuw)(w, BOTH(position)); }

static inline Weights less(Weights w, Weights part) { return w - part; }

#if VOXEL == VOXEL_U8
// The weighted sum of the bytes n and n + 1 of each lane's word.
static inline Int weigh(Int word, int n, Weights w) { return MULTIPLY_ADD(SHUFFLE(word, PAIR_ORDER + n * 0x10001), w); }
#else
static inline Int weigh(Int word, int n, Weights w) { return MULTIPLY_ADD(AS_WORDS(word ^ WORD_SIGNS), w); }
#endif

static inline Int product(Int small, int factor) { return MULTIPLY_ADD(AS_WORDS(small), AS_WORDS((Int)(factor))); }
#else
typedef struct { Int a, b; } Weights;

static inline Weights weights_at(Int x) {
    Weights w = {0x7fff - ((x >> 1) & 0x7fff), (x >> 1) & 0x7fff};
    return w;
}

static inline Weights farther(Weights w, Int position) {
    Weights part = {(w.a * (position & 0xffff)) >> 16, (w.b * (position & 0xffff)) >> 16};
    return part;
}

static inline Weights less(Weights w, Weights part) {
    Weights rest = {w.a - part.a, w.b - part.b};
    return rest;
}

#if VOXEL == VOXEL_U8
static inline Int weigh(Int word, int n, Weights w) { return ((word >> (8 * n)) & 0xff) * w.a + ((word >> (8 * n + 8)) & 0xff) * w.b; }
#else
static inline Int weigh(Int word, int n, Weights w) {
    Int both = word ^ WORD_SIGNS;
    return ((both << 16) >> 16) * w.a + (both >> 16) * w.b;
}
#endif

static inline Int product(Int small, int factor) { return small * factor; }
#endif

// A position or a displacement in whole parts of 2^-16 voxels.
typedef struct { Int x, y, z; } Fixed3;

static inline Fixed3 fixed3(Real3 p) {
    Fixed3 f = {to_int(p.x), to_int(p.y), to_int(p.z)};
    return f;
}

static inline Fixed3 fixed3_nearest(Real3 p) { return fixed3(real3(floor(p.x + 0.5f), floor(p.y + 0.5f), floor(p.z + 0.5f))); }

static inline Fixed3 add_fixed3(Fixed3 a, Fixed3 b) {
    Fixed3 sum = {a.x + b.x, a.y + b.y, a.z + b.z};
    return sum;
}

// A sample: its lowest corner in whole voxels, and the weights of the four pairs of voxels around it.
typedef struct { Fixed3 at; Int x, y, z; Weights near, next, far, beyond; } Inner;

static inline Inner inner_of(Fixed3 p) {
    Inner i;
    i.at = p, i.x = p.x >> 16, i.y = p.y >> 16, i.z = p.z >> 16;
    Weights all = weights_at(p.x), behind = farther(all, p.z), front = less(all, behind);
    i.next = farther(front, p.y), i.near = less(front, i.next);
    i.beyond = farther(behind, p.y), i.far = less(behind, i.beyond);
    return i;
}

static inline Inner inner_at(Real3 p) { return inner_of(fixed3(p)); }

// The offset in bytes of its lowest corner.
static inline Int inner_offset(constant const View *view, Inner i) {
    return ((product(i.z, view->dims[1]) + i.y) * view->dims[0] + i.x) * VOXEL_BYTES;
}

static inline Real inner_raw(constant const View *view, VOLUME voxels, Real3 p) {
    Inner i = inner_at(p);
    Int at = inner_offset(view, i);
    int row = view->dims[0] * VOXEL_BYTES, sheet = view->dims[1] * row;
    #define PAIR(step, weights) weigh(gather_words(voxels + (step), at), 0, weights)
    return WHOLE((PAIR(0, i.near) + PAIR(row, i.next)) + (PAIR(sheet, i.far) + PAIR(sheet + row, i.beyond)));
    #undef PAIR
}

// The four rows of voxels around a position.
typedef struct { Int here, below, behind, beyond; } Rows;

// The gradient by central differences, in floats beyond x, with the rows that a value needs. It takes twelve gathers of bytes, or twenty of words,
// instead of the 28 of seven values: a gather of four bytes in x serves three of them, and rows are shared.
static inline Real3 inner_slopes(constant const View *view, VOLUME voxels, Inner i, Rows *rows) {
    Int at = inner_offset(view, i);
    Weights all = weights_at(i.at.x);
    Real fy = to_real(i.at.y & 0xffff) * 0x1p-16f, fz = to_real(i.at.z & 0xffff) * 0x1p-16f;
    int row = view->dims[0] * VOXEL_BYTES, sheet = view->dims[1] * row;
#if VOXEL == VOXEL_U8
    global const uchar *from = voxels - 1; // the lanes are at least a voxel inside
    #define LINE_BYTE 1
    #define SLOPE(y, z, v) to_real(weigh(v, 2, all) - weigh(v, 0, all))
#else
    global const uchar *from = voxels;
    #define LINE_BYTE 0
    #define SLOPE(y, z, v) to_real(weigh(gather_words(from + ((y) * row + (z) * sheet + 2), at), 0, all) - weigh(gather_words(from + ((y) * row + (z) * sheet - 2), at), 0, all))
#endif
    #define ROW(y, z) gather_words(from + ((y) * row + (z) * sheet), at)
    #define LINE(v) WHOLE(weigh(v, LINE_BYTE, all))
    #define LERP(a, b, f) mad((b) - (a), f, a)
    Int va = ROW(0, 0), vb = ROW(1, 0), vc = ROW(0, 1), vd = ROW(1, 1);
    Real3 gradient;
    gradient.x = LERP(LERP(SLOPE(0, 0, va), SLOPE(0, 1, vc), fz), LERP(SLOPE(1, 0, vb), SLOPE(1, 1, vd), fz), fy);
    Real a = LINE(va), b = LINE(vb), c = LINE(vc), d = LINE(vd);
    Real before = LERP(LINE(ROW(-1, 0)), LINE(ROW(-1, 1)), fz), after = LERP(LINE(ROW(2, 0)), LINE(ROW(2, 1)), fz);
    gradient.y = LERP(LERP(b, d, fz), after, fy) - LERP(before, LERP(a, c, fz), fy);
    before = LERP(LINE(ROW(0, -1)), LINE(ROW(1, -1)), fy), after = LERP(LINE(ROW(0, 2)), LINE(ROW(1, 2)), fy);
    gradient.z = LERP(LERP(c, d, fy), after, fz) - LERP(before, LERP(a, b, fy), fz);
    #undef ROW
    #undef SLOPE
    #undef LINE
    #undef LERP
    rows->here = va, rows->below = vb, rows->behind = vc, rows->beyond = vd;
    return gradient;
}

static inline Real inner_gradient(constant const View *view, VOLUME voxels, Real3 p, Real3 *gradient) {
    Inner i = inner_at(p);
    Rows r;
    *gradient = inner_slopes(view, voxels, i, &r);
    #define PAIR(row, weights) weigh(r.row, LINE_BYTE, weights)
    return WHOLE((PAIR(here, i.near) + PAIR(below, i.next)) + (PAIR(behind, i.far) + PAIR(beyond, i.beyond)));
    #undef PAIR
}
#else
#define INNER_UNIT 1.0f
#define INNER_SCALE 1.0f
#define INNER_ROUNDING 0.0f

static inline Real inner_raw(constant const View *view, VOLUME voxels, Real3 p) {
#if INTERPOLATION != INTERPOLATION_TRILINEAR || VOLUMES_ARE_IMAGES
    return sample_raw(view, voxels, real3(p.x + 0.5f, p.y + 0.5f, p.z + 0.5f));
#else
    Int ix = to_int(p.x), iy = to_int(p.y), iz = to_int(p.z);
    Real fx = p.x - to_real(ix), fy = p.y - to_real(iy), fz = p.z - to_real(iz);
    int row = view->dims[0] * VOXEL_BYTES, sheet = view->dims[1] * row;
    Int at = ((iz * view->dims[1] + iy) * view->dims[0] + ix) * VOXEL_BYTES;
    Real near = lerp_x(voxels, at, fx), low = lerp_x(voxels + row, at, fx);
    Real far = lerp_x(voxels + sheet, at, fx), deep = lerp_x(voxels + sheet + row, at, fx);
    Real front = mad(low - near, fy, near), back = mad(deep - far, fy, far);
    return mad(back - front, fz, front);
#endif
}

static inline Real inner_gradient(constant const View *view, VOLUME voxels, Real3 p, Real3 *gradient) {
    *gradient = scale3(gradient_raw(view, voxels, real3(p.x + 0.5f, p.y + 0.5f, p.z + 0.5f)), (Real)(2.0f));
    return inner_raw(view, voxels, p);
}
#endif

// The gradient alone.
static inline Real3 inner_gradient_at(constant const View *view, VOLUME voxels, Real3 p) {
    Real3 gradient;
    inner_gradient(view, voxels, p, &gradient);
    return gradient;
}

// A displacement or a position in index units, scaled for inner_raw. Positions count from the middle of voxel 0.
static inline Real3 inner_way(Real3 way) { return scale3(way, (Real)(INNER_SCALE)); }
static inline Real3 inner_position(Real3 p) {
    Real3 position = inner_way(real3(p.x - 0.5f, p.y - 0.5f, p.z - 0.5f));
    return real3(position.x + INNER_ROUNDING, position.y + INNER_ROUNDING, position.z + INNER_ROUNDING);
}

#endif
