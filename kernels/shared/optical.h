// The transfer function on the device: a table of colours and opacities by value, and behind it the few polynomials that replace it if it is smooth
// except for some kinks.
#ifndef SHARED_OPTICAL_H
#define SHARED_OPTICAL_H

#include "shared/lanes.h"
#include "shared/voxel.h"

typedef struct { Real3 colour; Real alpha; } Optical;

// An entry of the table is two words. The first is the opacity's float without its ten lowest bits, which hold the upper bits of blue; blue's two
// lowest bits are at the top (an opacity is at most 1). The second is 16 bits each of red and green, rotated right by 25 and 9 bits.
typedef struct { Int word, red_green; } Entry;

static inline Entry entry_at(global const uchar *table, Int index) {
    Entry e;
    gather_pairs(table, index << 3, &e.word, &e.red_green);
    return e;
}

static inline Optical optical(Entry e) {
    Optical o;
    o.alpha = as_Real(e.word & 0x3ffffc00);
    Int green = as_Int(rotate(as_UInt(e.red_green), (UInt)(16u))), blue = as_Int(rotate(as_UInt(e.word), (UInt)(13u)));
    // The bits of a channel are those of the fraction of a float of 1 to 2.
    #define CHANNEL(bits, mask, most) ((as_Real(((bits) & (mask)) | 0x3f800000) - 1.0f) * ((most + 1.0f) / most))
    o.colour = real3(CHANNEL(e.red_green, 0x007fff80, 65535.0f), CHANNEL(green, 0x007fff80, 65535.0f), CHANNEL(blue, 0x007ff800, 4095.0f));
    #undef CHANNEL
    return o;
}

// Behind the table of a function that is smooth except for some kinks stand its pieces: their starts, the ends of their empty parts, and their
// polynomials, a cubic for the opacity and a line for each colour (src/technique/emission_absorption/pieces.rs).
typedef struct { float start[PIECES], empty[PIECES], opacity[4][PIECES], colour[3][2][PIECES]; } Pieces;

#define PIECES_OF(table) ((global const Pieces *)((table) + 8 * TABLE_SIZE))

// At the end of a table whose entries are denser at some values stand its knots: the places on an even table from which on entries have another
// density, the widths up to the next, and the entries per place (src/scene/transfer_table.rs).
typedef struct { float start[KNOTS], width[KNOTS], density[KNOTS]; } Knots;

#if PREINTEGRATED
#define KNOTS_OF(table) ((global const Knots *)((table) + 32 * TABLE_SIZE))
#else
#define KNOTS_OF(table) ((global const Knots *)(PIECES_OF(table) + 1))
#endif

// The position in the table of a place `x` on an even table.
static inline Real warped(constant const EmissionAbsorption *params, global const uchar *table, Real x) {
    global const Knots *knots = KNOTS_OF(table);
    Real position = (Real)(0.0f);
    for (int i = 0; i < params->knots; i++) {
        Real within = clamp(x - knots->start[i], (Real)(0.0f), (Real)(knots->width[i]));
        position = mad(within, (Real)(knots->density[i]), position);
    }
    return position;
}

// The place of a raw value in units of `unit` on an even table, whose entry i is at i.
static inline Real even_position(constant const EmissionAbsorption *params, Real raw, float unit) {
    Real x = mad(raw, (Real)(params->table_scale * unit), (Real)(params->table_offset - 0.5f));
    return clamp(x, (Real)(0.0f), (Real)(TABLE_SIZE - 1));
}

// The position of a raw value in the table: entry i is at i. It is NaN if the value is.
static inline Real table_position(constant const EmissionAbsorption *params, global const uchar *table, Real raw, float unit) {
    Real position = even_position(params, raw, unit);
    if (params->knots) position = warped(params, table, position);
#if VOXEL == VOXEL_F32
    position = select(position, raw, MASK(raw != raw));
#endif
    return position;
}

// The piece of a position; -1 if there are none.
static inline int piece_at(global const Pieces *t, float position) {
#if LANES == 16
    return count_lanes(MASK((Real)(position) >= *(global const Real *)t->start)) - 1;
#else
    int piece = -1;
    while (piece < PIECES - 1 && position >= t->start[piece + 1]) piece++;
    return piece;
#endif
}

// The pieces on which a set of samples lies.
typedef struct { int first, last; bool empty; } Span;

static inline Span span_of(global const uchar *table, float least, float greatest) {
    global const Pieces *t = PIECES_OF(table);
    Span s;
    s.first = piece_at(t, least), s.last = piece_at(t, greatest);
    s.empty = !(least <= greatest) || (s.first >= 0 && s.first == s.last && greatest <= t->empty[s.first]);
    return s;
}

#define ON_TABLE 0
#define ON_PIECE 1
#define ON_PIECES 2

static inline int form_of(Span s) { return s.first < 0 ? ON_TABLE : s.first == s.last ? ON_PIECE : ON_PIECES; }

#define POLYNOMIALS(PART)                                                                                                   \
    Real x = position - PART(t->start);                                                                                        \
    Real alpha = mad(mad(mad(PART(t->opacity[3]), x, PART(t->opacity[2])), x, PART(t->opacity[1])), x, PART(t->opacity[0])); \
    o.alpha = LESSER(alpha, (Real)(1.0f));                                                                                  \
    o.colour = real3(mad(PART(t->colour[0][1]), x, PART(t->colour[0][0])), mad(PART(t->colour[1][1]), x, PART(t->colour[1][0])), \
                     mad(PART(t->colour[2][1]), x, PART(t->colour[2][0])));

// The transfer function if all lanes are on one piece.
static inline Optical on_piece(global const Pieces *t, int piece, Real position) {
    Optical o;
    #define PART(column) (Real)((column)[piece])
    POLYNOMIALS(PART)
    #undef PART
    return o;
}

// The transfer function if the lanes are on several pieces.
static inline Optical on_pieces(global const Pieces *t, Span s, Real position) {
#if LANES == 16 && defined(__AVX512F__) && __has_builtin(__builtin_ia32_permvarsf512)
    Int piece = (Int)(s.first);
    for (int i = s.first + 1; i <= s.last; i++) piece -= MASK(position >= t->start[i]);
    Optical o;
    #define PART(column) __builtin_ia32_permvarsf512(*(global const Real *)(column), piece)
    POLYNOMIALS(PART)
    #undef PART
#else
    Optical o = on_piece(t, s.first, position);
    for (int i = s.first + 1; i <= s.last; i++) {
        Mask there = MASK(position >= t->start[i]);
        Optical next = on_piece(t, i, position);
        o.alpha = select(o.alpha, next.alpha, there), o.colour = select3(o.colour, next.colour, there);
    }
#endif
    return o;
}

// The transfer function at positions in the table, with the opacity of a whole step; a NaN is empty.
static inline Optical optical_at(global const uchar *table, Span s, int form, Real position) {
    Optical o;
#if VOXEL == VOXEL_F32
    Mask nan = MASK(position != position);
    position = select(position, (Real)(0.0f), nan);
#endif
    if (form == ON_PIECE) o = on_piece(PIECES_OF(table), s.first, position);
    else if (form == ON_PIECES) o = on_pieces(PIECES_OF(table), s, position);
    else o = optical(entry_at(table, to_int(position + 0.5f)));
#if VOXEL == VOXEL_F32
    o.alpha = select(o.alpha, (Real)(0.0f), nan);
#endif
    return o;
}

// The same at a raw value in units of `unit`.
static inline Optical classify(constant const EmissionAbsorption *params, global const uchar *table, Real raw, float unit) {
    Real position = table_position(params, table, raw, unit);
#if VOXEL == VOXEL_F32
    Mask nan = MASK(position != position);
    Span s = span_of(table, least_lane(select(position, (Real)(INFINITY), nan)), greatest_lane(select(position, (Real)(-INFINITY), nan)));
#else
    Span s = span_of(table, least_lane(position), greatest_lane(position));
#endif
    return optical_at(table, s, form_of(s), position);
}

#endif
