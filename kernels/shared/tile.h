// A work-item renders a tile of ITEM x ITEM pixels, as often as the pass's list says: how many entries, then for each the tile's number,
// the number of its next sample, and how many it gets; behind room for an entry of every tile, how much each has cost so far, in steps of
// its packets. A lane whose pixel is through takes the next one of the tile.
#if LANES == 1
#define ITEM 1
#else
#define ITEM 16
#endif
// Lanes that are free before more pixels are begun.
#define REFILL (LANES / 8 + 1)

typedef struct { int left, top; uint sample, times, cost_at; } Tile;

// The tile of the work-item; no times past the end of the list.
static inline Tile tile_at(constant const View *view, global uint *tiles) {
    uint number = (uint)view->first_beam + (uint)get_global_id(0);
    Tile t;
    t.left = t.top = 0;
    t.sample = t.times = t.cost_at = 0u;
    if (number >= tiles[0]) return t;
    global uint *entry = tiles + 1 + 3 * number;
    int wide = (view->width + ITEM - 1) / ITEM, high = (view->height + ITEM - 1) / ITEM;
    t.left = (int)entry[0] % wide * ITEM, t.top = (int)entry[0] / wide * ITEM;
    t.sample = entry[1], t.times = entry[2];
    t.cost_at = 1u + 3u * (uint)(wide * high) + entry[0];
    return t;
}

// Where in its pixel a sample goes through: the R2 sequence (Roberts 2018), in whole parts of 2^32, from the pixel's centre.
static inline float2 place_in_pixel(uint sample) {
    uint x = 0x80000000u + sample * 0xc13fa9a9u, y = 0x80000000u + sample * 0x91e10da6u;
    return (float2)((float)(x >> 8) * 0x1p-24f, (float)(y >> 8) * 0x1p-24f);
}

// Gives the free lanes the next pixels of the tile, from `taken` on. Returns the lanes that have a new one.
static inline Mask take_pixels(constant const View *view, Tile tile, Mask alive, int *taken, Int *column, Int *row) {
    IntLanes free, next;
    free.v = ~alive;
    for (int i = 0; i < LANES; i++) next.lane[i] = *taken, *taken -= free.lane[i];
    *column = tile.left + next.v % ITEM, *row = tile.top + next.v / ITEM;
    return ~alive & MASK(next.v < ITEM * ITEM) & MASK(*column < view->width) & MASK(*row < view->height);
}
