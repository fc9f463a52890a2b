// A volume in its own voxel type, x fastest. Index coordinates are cell-cornered: voxel i has its centre at i + 0.5 and
// the box is [0, n]; outside the outermost centres the edge value holds. The buffer is padded by 8 zero bytes.

// INTERPOLATION: how values lie between voxels.
#define NEAREST 0
#define TRILINEAR 1
#define B_SPLINE 2
#define CATMULL_ROM 3
#ifndef INTERPOLATION
#define INTERPOLATION TRILINEAR
#endif

// A volume is a buffer; on a GPU it is a 3D image, whose sampler interpolates in hardware (its weights have 8 fractional bits).
// The functions that read it have a body for each.
#if VOLUMES_ARE_IMAGES
#define VOLUME read_only image3d_t
constant const sampler_t linear_sampler = CLK_NORMALIZED_COORDS_FALSE | CLK_ADDRESS_CLAMP_TO_EDGE | CLK_FILTER_LINEAR;
constant const sampler_t point_sampler = CLK_NORMALIZED_COORDS_FALSE | CLK_ADDRESS_CLAMP_TO_EDGE | CLK_FILTER_NEAREST;
// Samplers filter whole numbers as parts of the largest.
#define CHANNEL_SCALE (VOXEL == VOXEL_U8 ? 255.0f : VOXEL == VOXEL_I16 ? 32767.0f : VOXEL == VOXEL_U16 ? 65535.0f : 1.0f)
#else
#define VOLUME global const uchar *
#endif

// One voxel a lane; the index is clamped to the grid.
static inline Real voxel_raw(constant const View *view, VOLUME voxels, Int x, Int y, Int z) {
    x = clamp(x, (Int)(0), (Int)(view->dims[0] - 1));
    y = clamp(y, (Int)(0), (Int)(view->dims[1] - 1));
    z = clamp(z, (Int)(0), (Int)(view->dims[2] - 1));
#if VOLUMES_ARE_IMAGES
    return read_imagef(voxels, point_sampler, (int4)(x, y, z, 0)).x * CHANNEL_SCALE;
#else
    Int word = gather_words(voxels, ((z * view->dims[1] + y) * view->dims[0] + x) * VOXEL_BYTES);
#if VOXEL == VOXEL_U8
    return to_real(word & 0xff);
#elif VOXEL == VOXEL_I16
    return to_real((word << 16) >> 16);
#elif VOXEL == VOXEL_U16
    return to_real(word & 0xffff);
#else
    return as_Real(word);
#endif
#endif
}

// The value of the voxel that p is in.
static inline Real nearest_raw(constant const View *view, VOLUME voxels, Real3 p) {
    return voxel_raw(view, voxels, to_int(floor(p.x)), to_int(floor(p.y)), to_int(floor(p.z)));
}

#if INTERPOLATION == TRILINEAR || INTERPOLATION == NEAREST
#define TAPS 2
#else
#define TAPS 4
#endif

// The weights of the voxels around a place, and their derivatives; f is how far it is past the one before it, from 0 to 1.
// Cubic B-spline (approximating) and Catmull-Rom (interpolating): Mitchell & Netravali, SIGGRAPH 1988, with (B, C) = (1, 0)
// and (0, 1/2).
static inline void tap_weights(Real f, Real weight[TAPS], Real slope[TAPS]) {
#if TAPS == 2
    weight[0] = 1.0f - f, weight[1] = f;
    slope[0] = (Real)(-1.0f), slope[1] = (Real)(1.0f);
#else
    Real g = 1.0f - f, ff = f * f, gg = g * g;
#if INTERPOLATION == B_SPLINE
    weight[0] = gg * g * (1.0f / 6.0f), weight[3] = ff * f * (1.0f / 6.0f);
    weight[1] = mad(ff, 0.5f * f - 1.0f, (Real)(2.0f / 3.0f)), weight[2] = mad(gg, 0.5f * g - 1.0f, (Real)(2.0f / 3.0f));
    slope[0] = -0.5f * gg, slope[3] = 0.5f * ff;
    slope[1] = mad(1.5f * f, f, -2.0f * f), slope[2] = mad(-1.5f * g, g, 2.0f * g);
#else
    weight[0] = -0.5f * f * gg, weight[3] = -0.5f * g * ff;
    weight[1] = mad(ff, 1.5f * f - 2.5f, (Real)(1.0f)), weight[2] = mad(gg, 1.5f * g - 2.5f, (Real)(1.0f));
    slope[0] = mad(mad(f, -1.5f, (Real)(2.0f)), f, (Real)(-0.5f)), slope[3] = -mad(mad(g, -1.5f, (Real)(2.0f)), g, (Real)(-0.5f));
    slope[1] = mad(4.5f * f, f, -5.0f * f), slope[2] = -mad(4.5f * g, g, -5.0f * g);
#endif
#endif
}

// The value at p and the gradient of the interpolant itself, in index units, tap by tap.
static inline Real taps_raw(constant const View *view, VOLUME voxels, Real3 p, Real3 *gradient) {
    Real3 low = real3(floor(p.x - 0.5f), floor(p.y - 0.5f), floor(p.z - 0.5f));
    Real wx[TAPS], wy[TAPS], wz[TAPS], dx[TAPS], dy[TAPS], dz[TAPS];
    tap_weights(p.x - 0.5f - low.x, wx, dx);
    tap_weights(p.y - 0.5f - low.y, wy, dy);
    tap_weights(p.z - 0.5f - low.z, wz, dz);
    Int x = to_int(low.x) - (TAPS / 2 - 1), y = to_int(low.y) - (TAPS / 2 - 1), z = to_int(low.z) - (TAPS / 2 - 1);
    Real value = (Real)(0.0f);
    *gradient = real3(value, value, value);
    for (int k = 0; k < TAPS; k++)
        for (int j = 0; j < TAPS; j++) {
            Real row = (Real)(0.0f), row_slope = (Real)(0.0f);
            for (int i = 0; i < TAPS; i++) {
                Real v = voxel_raw(view, voxels, x + i, y + j, z + k);
                row = mad(wx[i], v, row);
                row_slope = mad(dx[i], v, row_slope);
            }
            value = mad(wy[j] * wz[k], row, value);
            gradient->x = mad(wy[j] * wz[k], row_slope, gradient->x);
            gradient->y = mad(dy[j] * wz[k], row, gradient->y);
            gradient->z = mad(wy[j] * dz[k], row, gradient->z);
        }
    return value;
}

#if VOLUMES_ARE_IMAGES
// The raw value (before slope and intercept) at p, trilinear.
static inline Real trilinear_raw(constant const View *view, VOLUME voxels, Real3 p) {
    return read_imagef(voxels, linear_sampler, (float4)(p.x, p.y, p.z, 0.0f)).x * CHANNEL_SCALE;
}
#else
// Two neighbours in x, one load where their bits fit in a word: loads, not arithmetic, are what a sample costs.
static inline Real lerp_x(global const uchar *voxels, Int byte_offset, Real f) {
#if VOXEL == VOXEL_F32
    Real a = as_Real(gather_words(voxels, byte_offset)), b = as_Real(gather_words(voxels, byte_offset + 4));
#else
    Int pair = gather_words(voxels, byte_offset);
#if VOXEL == VOXEL_U8
    Real a = to_real(pair & 0xff), b = to_real((pair >> 8) & 0xff);
#elif VOXEL == VOXEL_I16
    Real a = to_real((pair << 16) >> 16), b = to_real(pair >> 16);
#else
    Real a = to_real(pair & 0xffff), b = to_real(as_Int(as_UInt(pair) >> 16));
#endif
#endif
    return mad(b - a, f, a);
}

// The raw value (before slope and intercept) at p, trilinear. A NaN voxel makes the whole of its eight cells NaN.
static inline Real trilinear_raw(constant const View *view, VOLUME voxels, Real3 p) {
    int nx = view->dims[0], ny = view->dims[1], nz = view->dims[2];
    Real x = clamp(p.x - 0.5f, (Real)(0.0f), (Real)(nx - 1));
    Real y = clamp(p.y - 0.5f, (Real)(0.0f), (Real)(ny - 1));
    Real z = clamp(p.z - 0.5f, (Real)(0.0f), (Real)(nz - 1));
    Int ix = min(to_int(x), (Int)(max(nx - 2, 0))), iy = min(to_int(y), (Int)(max(ny - 2, 0))), iz = min(to_int(z), (Int)(max(nz - 2, 0)));
    Real fx = x - to_real(ix), fy = y - to_real(iy), fz = z - to_real(iz);
    int row = (ny > 1 ? nx : 0) * VOXEL_BYTES, sheet = (nz > 1 ? nx * ny : 0) * VOXEL_BYTES;
    Int at = ((iz * ny + iy) * nx + ix) * VOXEL_BYTES;
    Real near = lerp_x(voxels, at, fx), low = lerp_x(voxels, at + row, fx);
    Real far = lerp_x(voxels, at + sheet, fx), deep = lerp_x(voxels, at + (row + sheet), fx);
    Real front = mad(low - near, fy, near), back = mad(deep - far, fy, far);
    return mad(back - front, fz, front);
}
#endif

// The raw value at p by the interpolation that is compiled in.
static inline Real sample_raw(constant const View *view, VOLUME voxels, Real3 p) {
#if INTERPOLATION == NEAREST
    return nearest_raw(view, voxels, p);
#elif INTERPOLATION == TRILINEAR
    return trilinear_raw(view, voxels, p);
#else
    Real3 unused;
    return taps_raw(view, voxels, p, &unused);
#endif
}

// The gradient of the raw value in index units, by central differences one voxel to each side.
static inline Real3 gradient_raw(constant const View *view, VOLUME voxels, Real3 p) {
    Real3 g;
    g.x = sample_raw(view, voxels, real3(p.x + 1.0f, p.y, p.z)) - sample_raw(view, voxels, real3(p.x - 1.0f, p.y, p.z));
    g.y = sample_raw(view, voxels, real3(p.x, p.y + 1.0f, p.z)) - sample_raw(view, voxels, real3(p.x, p.y - 1.0f, p.z));
    g.z = sample_raw(view, voxels, real3(p.x, p.y, p.z + 1.0f)) - sample_raw(view, voxels, real3(p.x, p.y, p.z - 1.0f));
    return scale3(g, (Real)(0.5f));
}

// What follows is for packets whose lanes are all at least INNER_MARGIN voxels away from the box's faces: no clamps. A place is
// given by inner_place, and values are in units of INNER_UNIT. Bytes are weighed along x in whole numbers, with weights of 15
// bits: exact to 2^-15 of their difference, and the same to the last bit for any number of lanes.
#define INNER_MARGIN 1.51f

#if INTERPOLATION == TRILINEAR && VOXEL == VOXEL_U8 && !VOLUMES_ARE_IMAGES
#define LERP(a, b, f) mad((b) - (a), f, a)
#define INNER_UNIT (1.0f / 32767.0f)
// A place comes with 15 binary places in x.
#define INNER_X 32768.0f

#if LANES == 16 && defined(__AVX512BW__) && __has_builtin(__builtin_ia32_pmaddwd512)
typedef short Words __attribute__((ext_vector_type(32)));
typedef char Bytes __attribute__((ext_vector_type(64)));
typedef Words Weights;
#define AS_WORDS(v) __builtin_astype(v, Words)
#define FOUR(a, b, c, d) ((Int)(a, b, c, d, a, b, c, d, a, b, c, d, a, b, c, d))
#define SHUFFLE(v, order) __builtin_astype(__builtin_ia32_pshufb512(__builtin_astype(v, Bytes), __builtin_astype(order, Bytes)), Words)
#define MULTIPLY_ADD(a, b) __builtin_astype(__builtin_ia32_pmaddwd512(a, b), Int)
// The bytes 0 and 1 of each lane as two words.
#define PAIR_ORDER FOUR(0x80018000, 0x80058004, 0x80098008, 0x800d800c)
// The low word of each lane in both.
#define BOTH(v) SHUFFLE(v, FOUR(0x01000100, 0x05040504, 0x09080908, 0x0d0c0d0c))

static inline Weights weights_x(Int x) {
    // (1 - f, f) as words: (f & 0x7fff7fff) ^ 0x7fff in one instruction
    Int f = __builtin_astype(BOTH(x), Int);
    return AS_WORDS(__builtin_ia32_pternlogd512_mask(f, (Int)(0x7fff7fff), (Int)(0x7fff), 0x6a, (short)-1));
}

// The bytes n and n + 1 of each lane's word, weighed.
static inline Int weigh(Int word, int n, Weights w) { return MULTIPLY_ADD(SHUFFLE(word, PAIR_ORDER + n * 0x10001), w); }

static inline Int product(Int small, int factor) { return MULTIPLY_ADD(AS_WORDS(small), AS_WORDS((Int)(factor))); }
#else
typedef Int Weights;
static inline Weights weights_x(Int x) { return x & 0x7fff; }
static inline Int weigh(Int word, int n, Weights f) {
    Int a = (word >> (8 * n)) & 0xff, b = (word >> (8 * n + 8)) & 0xff;
    return a * 32767 + (b - a) * f;
}
static inline Int product(Int small, int factor) { return small * factor; }
#endif

typedef struct { Int x, y, z; Weights weights; Real fy, fz; } Inner; // lowest corner in whole voxels

static inline Inner inner_at(Real3 p) {
    Inner i;
    Int x = to_int(p.x);
    i.weights = weights_x(x);
    i.x = x >> 15, i.y = to_int(p.y), i.z = to_int(p.z);
    i.fy = p.y - to_real(i.y), i.fz = p.z - to_real(i.z);
    return i;
}

static inline Int inner_offset(constant const View *view, Inner i) {
    return (product(i.z, view->dims[1]) + i.y) * view->dims[0] + i.x;
}

static inline Real inner_raw(constant const View *view, VOLUME voxels, Real3 p) {
    Inner i = inner_at(p);
    Int at = inner_offset(view, i);
    int row = view->dims[0], sheet = view->dims[0] * view->dims[1];
    #define LINE(step) to_real(weigh(gather_words(voxels + (step), at), 0, i.weights))
    Real a = LINE(0), b = LINE(row), c = LINE(sheet), d = LINE(sheet + row);
    #undef LINE
    Real near = LERP(a, c, i.fz), far = LERP(b, d, i.fz);
    return LERP(near, far, i.fy);
}

#if LANES == 16 && defined(__AVX512BW__) && __has_builtin(__builtin_ia32_pmaddwd512)
// The same where all lanes are within NARROW voxels of each other: the block of 4 x 4 x 4 voxels from `first` on, which is at
// most the lanes' least place, comes with one gather, a row a lane, and is read by permutations.
#define NARROW 1.98f

// One load wherever it lies; of four bytes the compiler makes two.
typedef struct __attribute__((packed)) { int word; } Unaligned;

static inline int4 load_rows(global const uchar *from, int row) {
    #define WORD(n) ((global const Unaligned *)(from + (n) * row))->word
    return (int4)(WORD(0), WORD(1), WORD(2), WORD(3));
    #undef WORD
}

static inline Int load_block(global const uchar *from, int row, int sheet) {
    return (Int)(load_rows(from, row), load_rows(from + sheet, row), load_rows(from + 2 * sheet, row), load_rows(from + 3 * sheet, row));
}

// The block of voxels for a step: `first` is its lowest corner, kept inside the volume.
typedef struct { Int rows; int4 first; } Block;

static inline Block block_at(constant const View *view, VOLUME voxels, int4 first) {
    int row = view->dims[0], sheet = view->dims[0] * view->dims[1];
    Block b;
    b.first = min(first, (int4)(row, view->dims[1], view->dims[2], 4) - 4);
    b.rows = load_block(voxels + ((size_t)b.first.z * sheet + b.first.y * row + b.first.x), row, sheet);
    return b;
}

static inline Real block_raw(const Block *block, Real3 p) {
    Inner i = inner_at(p);
    Int at = (i.z << 2) + i.y - (block->first.z * 4 + block->first.y);
    Int order = __builtin_astype(BOTH(i.x), Int) + (PAIR_ORDER - block->first.x * 0x10001);
    #define LINE(n) to_real(MULTIPLY_ADD(SHUFFLE(__builtin_ia32_permvarsi512(block->rows, at + (n)), order), i.weights))
    Real a = LINE(0), b = LINE(1), c = LINE(4), d = LINE(5);
    #undef LINE
    Real near = LERP(a, c, i.fz), far = LERP(b, d, i.fz);
    return LERP(near, far, i.fy);
}

static inline Real narrow_raw(constant const View *view, VOLUME voxels, Real3 p, int4 first) {
    Block b = block_at(view, voxels, first);
    return block_raw(&b, p);
}
#endif

// Value and gradient by central differences, in units of INNER_UNIT a voxel. Twelve gathers instead of the 28 of seven values: a
// gather of four voxels in x serves three of them, and rows are shared.
static inline Real inner_gradient(constant const View *view, VOLUME voxels, Real3 p, Real3 *gradient) {
    Inner i = inner_at(p);
    Int at = inner_offset(view, i);
    int row = view->dims[0], sheet = view->dims[0] * view->dims[1];
    global const uchar *from = voxels - 1; // the lanes are a voxel or more inside
    #define ROW(y, z) gather_words(from + ((y) * row + (z) * sheet), at)
    #define SLOPE(v) to_real(weigh(v, 2, i.weights) - weigh(v, 0, i.weights))
    #define LINE(v) to_real(weigh(v, 1, i.weights))
    Int va = ROW(0, 0), vb = ROW(1, 0), vc = ROW(0, 1), vd = ROW(1, 1);
    Real near = LERP(SLOPE(va), SLOPE(vc), i.fz), far = LERP(SLOPE(vb), SLOPE(vd), i.fz);
    gradient->x = 0.5f * LERP(near, far, i.fy);
    Real a = LINE(va), b = LINE(vb), c = LINE(vc), d = LINE(vd);
    Real y0 = LERP(a, c, i.fz), y1 = LERP(b, d, i.fz);
    Real before = LERP(LINE(ROW(-1, 0)), LINE(ROW(-1, 1)), i.fz), after = LERP(LINE(ROW(2, 0)), LINE(ROW(2, 1)), i.fz);
    gradient->y = 0.5f * (LERP(y1, after, i.fy) - LERP(before, y0, i.fy));
    Real z0 = LERP(a, b, i.fy), z1 = LERP(c, d, i.fy);
    before = LERP(LINE(ROW(0, -1)), LINE(ROW(1, -1)), i.fy), after = LERP(LINE(ROW(0, 2)), LINE(ROW(1, 2)), i.fy);
    gradient->z = 0.5f * (LERP(z1, after, i.fz) - LERP(before, z0, i.fz));
    #undef ROW
    #undef SLOPE
    #undef LINE
    return LERP(y0, y1, i.fy);
}
#else
#define INNER_UNIT 1.0f
#define INNER_X 1.0f

static inline Real inner_raw(constant const View *view, VOLUME voxels, Real3 p) {
#if INTERPOLATION != TRILINEAR || VOLUMES_ARE_IMAGES
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
    *gradient = gradient_raw(view, voxels, real3(p.x + 0.5f, p.y + 0.5f, p.z + 0.5f));
    return inner_raw(view, voxels, p);
}
#endif

// A place or a way in index units as inner_raw takes it: places count from the middle of voxel 0.
static inline Real3 inner_way(Real3 way) { return real3(way.x * INNER_X, way.y, way.z); }
static inline Real3 inner_place(Real3 p) { return inner_way(real3(p.x - 0.5f, p.y - 0.5f, p.z - 0.5f)); }
