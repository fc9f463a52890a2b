// Samples of 16 or 8 lanes that are within NARROW voxels of each other read the same 4 x 4 x 4 voxels. These are loaded row by row for all lanes, and
// read by permutations. Gathers lane by lane cost two to four times as much.
#ifndef SHARED_BLOCK_H
#define SHARED_BLOCK_H

#include "shared/inner.h"
#include "shared/lanes.h"
#include "shared/volume.h"

#if INTERPOLATION == INTERPOLATION_TRILINEAR && !VOLUMES_ARE_IMAGES
#if WEIGHTS_ARE_WORDS && (VOXEL == VOXEL_U8 || LANES == 16)
#define NARROW 1.98f
#elif VOXEL == VOXEL_F32 && LANES == 16 && defined(__AVX512F__) && __has_builtin(__builtin_ia32_vpermi2varps512)
#define NARROW 1.98f
#endif
#endif

#ifdef NARROW
static inline int4 load_rows(global const uchar *from, int row) {
    return (int4)(INT_AT(from), INT_AT(from + row), INT_AT(from + 2 * row), INT_AT(from + 3 * row));
}

// Gradients come from blocks as well if these are worth their loads.
#define NARROW_GRADIENTS (SHADED && LANES == 16)
#if NARROW_GRADIENTS
// Voxels that are read before and after the block, and the fewest voxels per side of a volume with room for them.
#define AROUND 1
#define NARROW_LEAST 6
#else
#define AROUND 0
#define NARROW_LEAST 4
#endif

// The blocks of eight steps: the offset of the lowest corner, and the terms that lead from a voxel's numbers to its row in the block
// (z * 4 + y), to its bytes in the row, and to its word in a field (z * 16 + y * 4 + x).
typedef struct { uint offset[8]; int rows[8], bytes[8], words[8]; } BlockOffsets;

// `low` is the least position of the lanes in the first step in voxels, `pace` its displacement to the next.
static inline BlockOffsets block_offsets(constant const View *view, float4 low, float4 pace) {
    float8 k = (float8)(0.0f, 1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f, 7.0f);
    #define FIRST(c, i) max(min(convert_int8(low.c + pace.c * k), view->dims[i] - 4 - AROUND), AROUND)
    int8 x = FIRST(x, 0), y = FIRST(y, 1), z = FIRST(z, 2);
    #undef FIRST
    BlockOffsets c;
    vstore8((as_uint8(z) * (uint)view->dims[1] + as_uint8(y)) * (uint)view->dims[0] + as_uint8(x), 0, c.offset);
    vstore8(-(z * 4 + y), 0, c.rows);
    vstore8(x * -0x10001, 0, c.bytes);
    vstore8(-(z * 16 + y * 4 + x), 0, c.words);
    return c;
}

// The block of voxels for a step, and the terms of its position.
#if VOXEL == VOXEL_U8 && LANES == 16
typedef struct { Int voxels, rows, bytes; } Block;
#define BLOCK_ROW(b, at) __builtin_ia32_permvarsi512((b)->voxels, at)
#elif VOXEL == VOXEL_U8
typedef struct { Int low, high, rows, bytes; } Block;
// Bit 3 of a row's number selects the register.
#define BLOCK_ROW(b, at) select(__builtin_ia32_permvarsi256((b)->low, at), __builtin_ia32_permvarsi256((b)->high, at), (at) << 28)
#elif VOXEL == VOXEL_F32
typedef struct { Real sheet[4]; int first; } Block;
#else
typedef struct { Words low, high; int first; } Block;
#endif

static inline long4 load_wide_rows(global const uchar *from, int row) {
    return (long4)(LONG_AT(from), LONG_AT(from + row), LONG_AT(from + 2 * row), LONG_AT(from + 3 * row));
}

// A block from the address of its lowest corner, and the terms that lead to its rows, bytes and words.
static inline Block block_from(constant const View *view, global const uchar *from, int rows, int bytes, int words) {
    int row = view->dims[0] * VOXEL_BYTES, sheet = view->dims[1] * row;
    Block b;
#if VOXEL == VOXEL_U8 && LANES == 16
    b.voxels = (Int)(load_rows(from, row), load_rows(from + sheet, row), load_rows(from + 2 * sheet, row), load_rows(from + 3 * sheet, row));
    b.rows = (Int)(rows), b.bytes = (Int)(bytes);
#elif VOXEL == VOXEL_U8
    b.low = (Int)(load_rows(from, row), load_rows(from + sheet, row));
    b.high = (Int)(load_rows(from + 2 * sheet, row), load_rows(from + 3 * sheet, row));
    b.rows = (Int)(rows), b.bytes = (Int)(bytes);
#elif VOXEL == VOXEL_F32
    for (int z = 0; z < 4; z++) {
        #define ROW(y) FOUR_AT(from + z * sheet + (y) * row)
        b.sheet[z] = (Real)(ROW(0), ROW(1), ROW(2), ROW(3));
        #undef ROW
    }
    b.first = words;
#else
    b.low = AS_WORDS((long8)(load_wide_rows(from, row), load_wide_rows(from + sheet, row)));
    b.high = AS_WORDS((long8)(load_wide_rows(from + 2 * sheet, row), load_wide_rows(from + 3 * sheet, row)));
    b.first = words;
#endif
    return b;
}

static inline Block block_at(constant const View *view, VOLUME voxels, const BlockOffsets *c, int i) {
    return block_from(view, voxels + (size_t)c->offset[i] * VOXEL_BYTES, c->rows[i], c->bytes[i], c->words[i]);
}

#if VOXEL == VOXEL_F32
// Interpolates in the block, by the arithmetic of inner_raw. The lanes' nearer voxels lie on three sheets. One permutation reads two of them, and
// another reads the third in the lanes that need it. The farther voxels are read likewise.
static inline Real block_raw(const Block *b, Real3 p) {
    Int ix = to_int(p.x), iy = to_int(p.y), iz = to_int(p.z), at = (iz << 4) + (iy << 2) + ix + b->first;
    Real fx = p.x - to_real(ix), fy = p.y - to_real(iy), fz = p.z - to_real(iz);
    Mask third = MASK((at & 0x20) != 0), first = MASK((at & 0x30) == 0);
    #define NEAR(n) select(__builtin_ia32_vpermi2varps512(b->sheet[0], at + (n), b->sheet[1]), __builtin_ia32_permvarsf512(b->sheet[2], at + (n)), third)
    #define FAR(n) select(__builtin_ia32_vpermi2varps512(b->sheet[2], at + (n), b->sheet[3]), __builtin_ia32_permvarsf512(b->sheet[1], at + (n)), first)
    #define LINE(CORNER, n) ({ Real a = CORNER(n); mad(CORNER((n) + 1) - a, fx, a); })
    Real near = LINE(NEAR, 0), low = LINE(NEAR, 4), far = LINE(FAR, 16), deep = LINE(FAR, 20);
    #undef LINE
    #undef FAR
    #undef NEAR
    Real front = mad(low - near, fy, near), back = mad(deep - far, fy, far);
    return mad(back - front, fz, front);
}
#elif VOXEL == VOXEL_U8
static inline Real block_raw(const Block *block, Inner i) {
    Int at = (i.z << 2) + i.y + block->rows;
    Int order = __builtin_astype(BOTH_HIGH(i.at.x), Int) + (PAIR_ORDER + block->bytes);
    #define PAIR(n, weights) MULTIPLY_ADD(SHUFFLE(BLOCK_ROW(block, at + (n)), order), weights)
    return to_real((PAIR(0, i.near) + PAIR(1, i.next)) + (PAIR(4, i.far) + PAIR(5, i.beyond)));
    #undef PAIR
}
#else
static inline Int block_sum(const Block *block, Inner i) {
    Int word = (i.z << 4) + (i.y << 2) + i.x + block->first, pair = (word | (word << 16)) + 0x10000;
    #define PAIR(n, weights) MULTIPLY_ADD(__builtin_ia32_vpermi2varhi512(block->low, AS_WORDS(pair + (n) * 0x10001), block->high) ^ AS_WORDS((Int)(WORD_SIGNS)), weights)
    return (PAIR(0, i.near) + PAIR(4, i.next)) + (PAIR(16, i.far) + PAIR(20, i.beyond));
    #undef PAIR
}

static inline Real block_raw(const Block *block, Inner i) { return WHOLE(block_sum(block, i)); }
#endif

// The same for a single step, whose least position is `low`.
static inline Real narrow_raw(constant const View *view, VOLUME voxels, Real3 p, float4 low) {
    int4 first = min(convert_int4(low), (int4)(view->dims[0], view->dims[1], view->dims[2], 4) - 4);
    size_t offset = ((size_t)first.z * view->dims[1] + first.y) * view->dims[0] + first.x;
    int rows = -(first.z * 4 + first.y), words = 4 * rows - first.x;
    Block block = block_from(view, voxels + offset * VOXEL_BYTES, rows, first.x * -0x10001, words);
#if INNER_WHOLE
    return block_raw(&block, inner_at(p));
#else
    return block_raw(&block, p);
#endif
}

#if NARROW_GRADIENTS && VOXEL == VOXEL_U8
// The block of a gradient, with its surroundings: its rows from a voxel before to three after, two registers of eight, and four rows each beside it:
// before and after in y for each z, before and after in z for each y.
typedef struct { long8 low, high; Int beside; } WideBlock;

static inline WideBlock wide_block_at(constant const View *view, global const uchar *from) {
    int row = view->dims[0], sheet = view->dims[0] * view->dims[1];
    WideBlock b;
    b.low = (long8)(load_wide_rows(from - 1, row), load_wide_rows(from - 1 + sheet, row));
    b.high = (long8)(load_wide_rows(from - 1 + 2 * sheet, row), load_wide_rows(from - 1 + 3 * sheet, row));
    b.beside = (Int)(load_rows(from - row, sheet), load_rows(from + 4 * row, sheet), load_rows(from - sheet, row), load_rows(from + 4 * sheet, row));
    return b;
}

// Deals rows in pairs, row z * 4 + y after the one before: each quarter of a register gets a pair of the block's first eight rows, and behind each
// stands a pair of its last eight. So the result of unpack instructions on all quarters, first the lower halves, then the upper, is in order.
#define DEALT(v, w) __builtin_shufflevector(v, w, 0, 2, 16, 18, 4, 6, 20, 22, 8, 10, 24, 26, 12, 14, 28, 30)
#define ROW_AFTER(v, w) __builtin_shufflevector(v, w, 1, 4, 3, 6, 5, 20, 7, 22, 9, 12, 11, 14, 13, 21, 15, 23)
#define ROW_BEFORE(v, w) __builtin_shufflevector(v, w, 16, 0, 18, 2, 1, 4, 3, 6, 17, 8, 19, 10, 9, 12, 11, 14)
#define SHEET_AFTER(v, w) __builtin_shufflevector(v, w, 8, 9, 10, 11, 12, 13, 14, 15, 2, 3, 28, 29, 6, 7, 30, 31)
#define SHEET_BEFORE(v, w) __builtin_shufflevector(v, w, 24, 25, 8, 9, 26, 27, 12, 13, 0, 1, 2, 3, 4, 5, 6, 7)

// The rows that start x voxels beside the block's lowest corner, dealt.
static inline Int wide_rows(const WideBlock *b, int x) {
    return DEALT(as_int16(b->low >> (8 * x + 8)), as_int16(b->high >> (8 * x + 8)));
}

typedef struct { Words low, high; } Field; // a word for each voxel of the block

// The differences of two sets of bytes in dealt rows.
static inline Field field_of(Int after, Int before) {
    Bytes a = __builtin_astype(after, Bytes), b = __builtin_astype(before, Bytes), signs = __builtin_astype((Int)(0xff01ff01), Bytes);
    #define QUARTER(f, n) f(n), f(n + 1), f(n + 2), f(n + 3), f(n + 4), f(n + 5), f(n + 6), f(n + 7)
    #define BOTH_OF(n) n, n + 64
    #define UNPACKED(n) __builtin_shufflevector(a, b, QUARTER(BOTH_OF, n), QUARTER(BOTH_OF, n + 16), QUARTER(BOTH_OF, n + 32), QUARTER(BOTH_OF, n + 48))
    Field f = {__builtin_ia32_pmaddubsw512(UNPACKED(0), signs), __builtin_ia32_pmaddubsw512(UNPACKED(8), signs)};
    #undef UNPACKED
    #undef BOTH_OF
    #undef QUARTER
    return f;
}

// The field between its voxels; `pair` is the words of a lane's lowest corner and the next in x.
static inline Real field_between(Field f, Int pair, const Inner *i) {
    #define PAIR(n, weights) MULTIPLY_ADD(__builtin_ia32_vpermi2varhi512(f.low, AS_WORDS(pair + (n) * 0x10001), f.high), weights)
    return to_real((PAIR(0, i->near) + PAIR(4, i->next)) + (PAIR(16, i->far) + PAIR(20, i->beyond)));
    #undef PAIR
}

// The gradient by central differences in step k of eight. The differences at the block's voxels are computed once for all lanes, and interpolated for
// each.
static inline Real3 narrow_gradient(constant const View *view, VOLUME voxels, const BlockOffsets *offsets, int k, Inner i) {
    WideBlock b = wide_block_at(view, voxels + offsets->offset[k]);
    Int word = (i.z << 4) + (i.y << 2) + i.x + offsets->words[k], pair = (word | (word << 16)) + 0x10000;
    Int rows = wide_rows(&b, 0);
    Field x = field_of(wide_rows(&b, 1), wide_rows(&b, -1));
    Field y = field_of(ROW_AFTER(rows, b.beside), ROW_BEFORE(rows, b.beside));
    Field z = field_of(SHEET_AFTER(rows, b.beside), SHEET_BEFORE(rows, b.beside));
    return real3(field_between(x, pair, &i), field_between(y, pair, &i), field_between(z, pair, &i));
}
#elif NARROW_GRADIENTS
// The gradient by central differences in step k of eight, from the blocks one voxel to each side.
static inline Real3 narrow_gradient(constant const View *view, VOLUME voxels, const BlockOffsets *offsets, int k,
#if INNER_WHOLE
                                    Inner i) {
#else
                                    Real3 p) {
#endif
    int row = view->dims[0] * VOXEL_BYTES, sheet = view->dims[1] * row;
    global const uchar *from = voxels + (size_t)offsets->offset[k] * VOXEL_BYTES;
    #define AT(step) block_from(view, from + (step), offsets->rows[k], offsets->bytes[k], offsets->words[k])
#if INNER_WHOLE
    #define SLOPE(step) ({ Block after = AT(step), before = AT(-(step)); to_real(block_sum(&after, i) - block_sum(&before, i)); })
#else
    #define SLOPE(step) ({                                                                              \
        Block after = AT(step), before = AT(-(step));                                                   \
        for (int z = 0; z < 4; z++) after.sheet[z] -= before.sheet[z];                                  \
        block_raw(&after, p);                                                                           \
    })
#endif
    return real3(SLOPE(VOXEL_BYTES), SLOPE(row), SLOPE(sheet));
    #undef SLOPE
    #undef AT
}
#endif
#endif

#endif
