// The pixels that a work-item of a view renders: a beam of BEAM_W x BEAM_H packets of TILE_W x TILE_H pixels, so that neighbours find each other's
// voxels in the nearest cache.
#ifndef SHARED_BEAM_H
#define SHARED_BEAM_H

#include "shared/lanes.h"

#if LANES == 1
#define BEAM_W 1
#define BEAM_H 1
#else
#define BEAM_W 2
#define BEAM_H 2
#endif
#define PACKETS (BEAM_W * BEAM_H)

// The number of beams of the pass.
static inline int beams(constant const View *view) {
    int w = TILE_W * BEAM_W, h = TILE_H * BEAM_H;
    return ((view->width + w - 1) / w) * ((view->height + h - 1) / h);
}

// The first pixel of a packet of a beam: column and row in this pass's pixels.
static inline int2 packet_corner(constant const View *view, int number, int packet) {
    int beams_wide = (view->width + TILE_W * BEAM_W - 1) / (TILE_W * BEAM_W);
    int left = (number % beams_wide) * TILE_W * BEAM_W, top = (number / beams_wide) * TILE_H * BEAM_H;
    return (int2)(left + (packet % BEAM_W) * TILE_W, top + (packet / BEAM_W) * TILE_H);
}

#endif
