// How many voxels have which value. One work-item counts a run of voxels; counts are whole numbers, so their order does not matter.
// Behind the counts of the bins are those of voxels below the range, above it, and without a value.

#include "shared/voxel.h"

#if VOLUMES_ARE_IMAGES
#define VOXELS read_only image3d_t
constant const sampler_t point_sampler = CLK_NORMALIZED_COORDS_FALSE | CLK_ADDRESS_CLAMP_TO_EDGE | CLK_FILTER_NEAREST;
// Samplers give whole numbers as parts of the largest.
#define CHANNEL_SCALE (VOXEL == VOXEL_U8 ? 255.0f : VOXEL == VOXEL_I16 ? 32767.0f : VOXEL == VOXEL_U16 ? 65535.0f : 1.0f)
static inline float raw_of(VOXELS voxels, uint voxel) {
    uint wide = (uint)get_image_width(voxels), high = (uint)get_image_height(voxels);
    int4 at = (int4)((int)(voxel % wide), (int)(voxel / wide % high), (int)(voxel / wide / high), 0);
    return read_imagef(voxels, point_sampler, at).x * CHANNEL_SCALE;
}
#else
#define VOXELS global const Voxel *
static inline float raw_of(VOXELS voxels, uint voxel) {
    return (float)voxels[voxel];
}
#endif

kernel void histogram(constant HistogramPass *pass, VOXELS voxels, global uint *counts) {
    uint item = (uint)get_global_id(0);
    uint left = pass->end - pass->first;
    if (item > left / pass->per_item) return;
    uint first = pass->first + item * pass->per_item;
    uint count = min(pass->per_item, pass->end - first);
    for (uint i = 0; i < count; i++) {
        float raw = raw_of(voxels, first + i);
        float place = (raw - pass->low) * pass->per_raw;
        // The highest value belongs to the last bin.
        int bin = place < (float)pass->bins ? (int)place : place == (float)pass->bins ? pass->bins - 1 : pass->bins + 1;
        bin = place < 0.0f ? pass->bins : bin;
        bin = isnan(place) ? pass->bins + 2 : bin;
        atomic_inc(counts + bin);
    }
}
