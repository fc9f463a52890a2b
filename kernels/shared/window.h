// Window, level and colour map: a table of linear colours, four floats an entry, linear between entries (src/scene/window.rs).
#ifndef SHARED_WINDOW_H
#define SHARED_WINDOW_H

#include "shared/film.h"
#include "shared/lanes.h"
#include "shared/packet.h"

// The colour of a value; entry = value scale + offset. NaN has the first colour.
static inline Real3 window_colour(global const uchar *table, float scale, float offset, Real value) {
    Real x = mad(value, (Real)(scale), (Real)(offset));
    x = clamp(select((Real)(0.0f), x, MASK(x == x)), (Real)(0.0f), (Real)(WINDOW_SIZE - 1));
    Int entry = min(to_int(x), (Int)(WINDOW_SIZE - 2));
    Real f = x - to_real(entry);
    global const float *rgb = (global const float *)table;
    entry <<= 2;
    #define CHANNEL(c) mad(gather_reals(rgb, entry + (4 + c)) - gather_reals(rgb, entry + c), f, gather_reals(rgb, entry + c))
    return real3(CHANNEL(0), CHANNEL(1), CHANNEL(2));
    #undef CHANNEL
}

// Adds the values of the lanes `shown` to the film: their colours, or the values themselves. The others are transparent.
static inline void film_value(constant const View *view, global float *film, global uint *counts, const Packet *p, global const uchar *table,
                              float scale, float offset, int raw_values, Real value, Mask shown) {
    Real3 colour = raw_values ? real3(value, value, value) : window_colour(table, scale, offset, value);
    Real3 black = real3((Real)(0.0f), (Real)(0.0f), (Real)(0.0f));
    film_packet(view, film, counts, p->column, p->row, select3(black, colour, shown), select((Real)(0.0f), (Real)(1.0f), shown));
}

#endif
