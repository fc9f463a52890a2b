// Grids of fields: floats from fixed-point sums, words of 16 bits from floats, and NaN for values that are not finite. A work-item has one voxel.
//
// Results are the host's to the bit. A contraction would round otherwise, so it is off.

#pragma OPENCL EXTENSION cl_khr_fp64 : enable
#pragma OPENCL FP_CONTRACT OFF

// The floats of sums in `grids` grids of 64-bit integers, which follow each other: their total, modulo 2^64 and signed, times the scale.
kernel void of_sums(constant SumsPass *pass, global const ulong *sums, global float *values, global int *near_overflow) {
    size_t voxel = get_global_id(0);
    if (voxel >= pass->voxels) return;
    ulong total = 0;
    for (uint grid = 0; grid < pass->grids; grid++) total += sums[(size_t)grid * pass->voxels + voxel];
    // Every item writes the same.
    if (abs((long)total) > NEAR_OVERFLOW) *near_overflow = 1;
    double scale = as_double((ulong)pass->scale[1] << 32 | pass->scale[0]);
    values[voxel] = (float)((double)(long)total * scale);
}

kernel void in_words(constant WordsPass *pass, global const float *values, global ushort *words) {
    size_t voxel = get_global_id(0);
    if (voxel < pass->voxels) words[voxel] = convert_ushort_sat_rtz((values[voxel] - pass->first) * pass->per_value + 0.5f);
}

// NaN is the mark of a voxel without a value.
kernel void mark_non_finite(constant uint *voxels, global float *values) {
    size_t voxel = get_global_id(0);
    if (voxel < *voxels && !isfinite(values[voxel])) values[voxel] = NAN;
}
