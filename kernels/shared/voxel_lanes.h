// Single voxels of a volume, one per lane.
#ifndef SHARED_VOXEL_LANES_H
#define SHARED_VOXEL_LANES_H

#include "shared/image.h"
#include "shared/lanes.h"
#include "shared/voxel.h"

// The voxel at the start of a word.
static inline Real first_voxel(Int word) {
#if VOXEL == VOXEL_U8
    return to_real(word & 0xff);
#elif VOXEL == VOXEL_I16
    return to_real((word << 16) >> 16);
#elif VOXEL == VOXEL_U16
    return to_real(word & 0xffff);
#else
    return as_Real(word);
#endif
}

// One voxel per lane, by indices that are in the grid.
static inline Real voxel_at(constant const int *dims, VOLUME voxels, Int x, Int y, Int z) {
#if VOLUMES_ARE_IMAGES
    return read_imagef(voxels, point_sampler, (int4)(x, y, z, 0)).x * CHANNEL_SCALE;
#else
    return first_voxel(gather_words(voxels, ((z * dims[1] + y) * dims[0] + x) * VOXEL_BYTES));
#endif
}

#endif
