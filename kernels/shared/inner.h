// Samples of packets whose lanes are all at least INNER_MARGIN voxels away from the box's faces: no clamps. A place is
// given by inner_place, and values are in units of INNER_UNIT. Bytes are weighed along x in whole numbers, with weights of 15
// bits: exact to 2^-15 of their difference, and the same to the last bit for any number of lanes.
#define INNER_MARGIN 1.51f

#if INTERPOLATION == TRILINEAR && VOXEL == VOXEL_U8 && !VOLUMES_ARE_IMAGES
#define INNER_BYTES 1
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
