// Pictures are sampled by tiles of TILE x TILE pixels, one per work-item: a lane whose pixel is done takes the next one of the tile. With one lane a
// work-item is one of a tile's pixels. `tiles` lists them: their number, the number of their next sample, and if a list follows; the list has for
// each entry the tile, the number of its next sample, and the number of its samples. Behind the room for all tiles stands the cost of each tile so
// far, in steps of its packets.
#ifndef SHARED_TILE_H
#define SHARED_TILE_H

#include "shared/lanes.h"

#if LANES == 1
#define ITEM 1
#define ITEMS (TILE * TILE)
#else
#define ITEM TILE
#define ITEMS 1
#endif
// The number of free lanes at which more pixels are begun.
#define REFILL (LANES / 8 + 1)

typedef struct { int left, top; uint sample, times, cost_at; } Tile;

// The tile or pixel of the work-item; `times` is 0 past the end of the pass.
static inline Tile tile_at(constant const View *view, global const uint *tiles) {
    uint number = (uint)view->first_beam + (uint)get_global_id(0), entry = number / ITEMS, part = number % ITEMS;
    Tile t;
    t.left = t.top = 0;
    t.sample = t.times = t.cost_at = 0u;
    if (entry >= tiles[0]) return t;
    global const uint *listed = tiles + TILES_HEADER + 3 * entry;
    int wide = (view->width + TILE - 1) / TILE, high = (view->height + TILE - 1) / TILE, tile = (int)(tiles[2] ? listed[0] : entry);
    t.left = tile % wide * TILE + (int)(part % TILE), t.top = tile / wide * TILE + (int)(part / TILE);
    t.sample = tiles[2] ? listed[1] : tiles[1], t.times = tiles[2] ? listed[2] : 1u;
    t.cost_at = TILES_HEADER + 3u * (uint)(wide * high) + (uint)tile;
    return t;
}

static inline void cost(global uint *tiles, Tile tile, uint steps) {
    if (tile.times > 0u) atomic_add(&tiles[tile.cost_at], steps);
}

// Gives the free lanes the next pixels of the tile, from `taken` on. Returns the lanes that have a new one.
static inline Mask take_pixels(constant const View *view, Tile tile, Mask alive, int *taken, Int *column, Int *row) {
    IntLanes free, next;
    free.v = ~alive;
    for (int i = 0; i < LANES; i++) next.lane[i] = *taken, *taken -= free.lane[i];
    *column = tile.left + next.v % ITEM, *row = tile.top + next.v / ITEM;
    return ~alive & MASK(next.v < ITEM * ITEM) & MASK(*column < view->width) & MASK(*row < view->height);
}

#endif
