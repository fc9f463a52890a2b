// Cells of one size along each axis, crossed from boundary to boundary (DDA), and the classification of tentative collisions, which are drawn with a
// majorant. TRACKING selects the way to find a free path:
//   EXACT    cells are as large as the extinction is constant (Amanatides & Woo, Eurographics 1987, for voxels): tau = sum sigma_i s_i
//   MARCH    steps of one length, each with the extinction at its start; a path ends with the step that uses it up
//   DELTA    cells are coarse blocks, tentative collisions by the block's majorant m, real ones with probability sigma / m
//            (Woodcock et al., ANL-7050, 1965)
//   WEIGHTED the same where m may be too small: real with probability P = sigma / (sigma + |m - sigma|), weight times
//            sigma / (m P) or (m - sigma) / (m (1 - P)) (Galtier et al., JQSRT 125, 2013)
#ifndef SHARED_DDA_H
#define SHARED_DDA_H

#include "shared/lanes.h"

#define BY_MAJORANTS (TRACKING == TRACKING_DELTA || TRACKING == TRACKING_WEIGHTED)

// A voxel, a layer (z) or a block.
typedef struct { Int x, y, z; } Cell;

static inline Int cell_on_axis(Real p, float low, float cells_per_length, int cells) {
    return clamp(to_int(floor((p - low) * cells_per_length)), (Int)(0), (Int)(cells - 1));
}

// The boundary ahead of a cell; the last cell may be cut short.
static inline Real boundary_on_axis(Int cell, Mask up, float low, float side, float high, int cells) {
    Int next = select(cell, cell + 1, up);
    return select(mad(to_real(next), (Real)(side), (Real)(low)), (Real)(high), MASK(next >= cells));
}

static inline Real distance_to(Real boundary, Real p, Real d) {
    return select(fmax((boundary - p) * reciprocal(d), (Real)(0.0f)), (Real)(1e30f), MASK(fabs(d) < 1e-12f));
}

#if BY_MAJORANTS
// Classifies the tentative collisions `hit` by the number u. Returns the real ones; weights have to be multiplied by *factor.
static inline Mask real_collisions(Real sigma, Real rate, Real u, Mask hit, Real *factor) {
#if TRACKING == TRACKING_DELTA
    *factor = (Real)(1.0f);
    return hit & MASK(u * rate < sigma);
#else
    Real null = rate - sigma, chance = sigma / (sigma + fabs(null));
    Mask real = hit & MASK(u < chance);
    *factor = select(null / (rate * (1.0f - chance)), sigma / (rate * chance), real);
    return real;
#endif
}
#endif

#endif
