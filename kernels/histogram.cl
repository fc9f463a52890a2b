// The number of voxels per value. One work-item counts a run of voxels. Counts are whole numbers, so that their order does not matter. Behind the
// counts of the bins are those of voxels below the range, above it, and without a value.

#include "shared/image.h"
#include "shared/voxel.h"

static inline float raw_of(VOLUME voxels, uint voxel) {
#if VOLUMES_ARE_IMAGES
    uint wide = (uint)get_image_width(voxels), high = (uint)get_image_height(voxels);
    int4 at = (int4)((int)(voxel % wide), (int)(voxel / wide % high), (int)(voxel / wide / high), 0);
    return read_imagef(voxels, point_sampler, at).x * CHANNEL_SCALE;
#else
    return (float)((global const Voxel *)voxels)[voxel];
#endif
}

kernel void histogram(constant HistogramPass *pass, VOLUME voxels, global uint *counts) {
    ulong before = get_global_id(0) * (ulong)pass->per_item, left = pass->end - pass->first;
    if (before >= left) return;
    uint first = pass->first + (uint)before, count = (uint)min((ulong)pass->per_item, left - before);
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
