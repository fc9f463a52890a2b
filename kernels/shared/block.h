// Samples of 16 lanes that are within NARROW voxels of each other: the 4 x 4 x 4 voxels that they read come by a load a row, all
// lanes together, and are read by permutations. What a lane would gather for itself costs two to four times as much.
#if defined(INNER_BYTES) && LANES == 16 && defined(__AVX512BW__) && __has_builtin(__builtin_ia32_pmaddwd512)
#define NARROW 1.98f

// One load wherever it lies; of vload4's four bytes the compiler makes several.
typedef struct __attribute__((packed)) { int word; } UnalignedInt;
typedef struct __attribute__((packed)) { long word; } UnalignedLong;
#define INT_AT(from) ((global const UnalignedInt *)(from))->word
#define LONG_AT(from) ((global const UnalignedLong *)(from))->word

static inline int4 load_rows(global const uchar *from, int row) {
    return (int4)(INT_AT(from), INT_AT(from + row), INT_AT(from + 2 * row), INT_AT(from + 3 * row));
}

// The block of voxels for a step: `first` is its lowest corner.
typedef struct { Int rows; int4 first; } Block;

// At most the lanes' least place in whole voxels.
static inline Block block_at(constant const View *view, VOLUME voxels, int4 first) {
    int row = view->dims[0], sheet = view->dims[0] * view->dims[1];
    Block b;
    b.first = min(first, (int4)(row, view->dims[1], view->dims[2], 4) - 4);
    global const uchar *from = voxels + ((size_t)b.first.z * sheet + b.first.y * row + b.first.x);
    b.rows = (Int)(load_rows(from, row), load_rows(from + sheet, row), load_rows(from + 2 * sheet, row), load_rows(from + 3 * sheet, row));
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

// The same block with what is around it, for gradients: its rows from a voxel before to three after, two registers of eight, and
// four rows each beside it: before and after in y for each z, before and after in z for each y.
typedef struct { long8 low, high; Int beside; int4 first; } WideBlock;

// The fewest voxels a side that a wide block fits in.
#define WIDE_LEAST 6

static inline long4 load_wide_rows(global const uchar *from, int row) {
    return (long4)(LONG_AT(from), LONG_AT(from + row), LONG_AT(from + 2 * row), LONG_AT(from + 3 * row));
}

static inline WideBlock wide_block_at(constant const View *view, VOLUME voxels, int4 first) {
    int row = view->dims[0], sheet = view->dims[0] * view->dims[1];
    WideBlock b;
    b.first = max(min(first, (int4)(row, view->dims[1], view->dims[2], 6) - 5), (int4)(1));
    global const uchar *from = voxels + ((size_t)b.first.z * sheet + b.first.y * row + b.first.x);
    b.low = (long8)(load_wide_rows(from - 1, row), load_wide_rows(from - 1 + sheet, row));
    b.high = (long8)(load_wide_rows(from - 1 + 2 * sheet, row), load_wide_rows(from - 1 + 3 * sheet, row));
    b.beside = (Int)(load_rows(from - row, sheet), load_rows(from + 4 * row, sheet), load_rows(from - sheet, row), load_rows(from + 4 * sheet, row));
    return b;
}

typedef uchar Row32 __attribute__((ext_vector_type(32)));
typedef struct { Words low, high; } Field; // a word for each voxel of the block

// The differences of two sets of bytes.
static inline Field field_of(Int after, Int before) {
    #define WORDS(half) __builtin_convertvector(__builtin_astype(half, Row32), Words)
    Field f = {WORDS(after.lo) - WORDS(before.lo), WORDS(after.hi) - WORDS(before.hi)};
    #undef WORDS
    return f;
}

// The field between its voxels; `order` names the pair of words at a lane's lowest corner.
static inline Real field_between(Field f, Int order, const Inner *i) {
    #define LINE(n) to_real(MULTIPLY_ADD(__builtin_ia32_vpermi2varhi512(f.low, AS_WORDS(order + (n) * 0x10001), f.high), i->weights))
    Real a = LINE(0), b = LINE(4), c = LINE(16), d = LINE(20);
    #undef LINE
    Real near = LERP(a, c, i->fz), far = LERP(b, d, i->fz);
    return LERP(near, far, i->fy);
}

// The rows from x voxels beside the block's lowest corner on.
static inline Int wide_rows(const WideBlock *b, int x) {
    return (Int)(as_int16(b->low >> (8 * x + 8)).even, as_int16(b->high >> (8 * x + 8)).even);
}

static inline Real wide_raw(const WideBlock *b, Real3 p) {
    Block block = {wide_rows(b, 0), b->first};
    return block_raw(&block, p);
}

// The gradient by central differences, in units of INNER_UNIT a voxel: the differences at the block's voxels are worked out once for
// all lanes, and what lies between them is interpolated for each.
static inline Real3 wide_gradient(const WideBlock *b, Real3 p) {
    Inner i = inner_at(p);
    Int at = (i.z << 4) + (i.y << 2) + i.x - (b->first.z * 16 + b->first.y * 4 + b->first.x);
    Int order = (at | (at << 16)) + 0x10000, rows = wide_rows(b, 0);
    #define MOVED(...) __builtin_shufflevector(rows, b->beside, __VA_ARGS__)
    Field x = field_of(wide_rows(b, 1), wide_rows(b, -1));
    Field y = field_of(MOVED(1, 2, 3, 20, 5, 6, 7, 21, 9, 10, 11, 22, 13, 14, 15, 23), MOVED(16, 0, 1, 2, 17, 4, 5, 6, 18, 8, 9, 10, 19, 12, 13, 14));
    Field z = field_of(MOVED(4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 28, 29, 30, 31), MOVED(24, 25, 26, 27, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11));
    #undef MOVED
    return scale3(real3(field_between(x, order, &i), field_between(y, order, &i), field_between(z, order, &i)), (Real)(0.5f));
}
#endif
