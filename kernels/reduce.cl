// Sums, extremes and counts of floats. A work-item reduces a block of BLOCK values in their order, and the host sums the blocks in theirs, so that the
// result is the same for any number of threads and lanes.
//
// Sums are compensated (Neumaier, ZAMM 54, 1974): the part that an addition rounds away is kept apart, and fma gives the exact error of a product.
// Contraction would break this, so it is off.

#pragma OPENCL FP_CONTRACT OFF

// A sum, and the part that its additions have rounded away.
static inline float2 added(float2 sum, float value) {
    float next = sum.x + value;
    float lost = fabs(sum.x) >= fabs(value) ? (sum.x - next) + value : (value - next) + sum.x;
    return (float2)(next, sum.y + lost);
}

// The values of a work-item's block; none past the end.
static inline int2 block_of(constant int *count) {
    int first = (int)get_global_id(0) * BLOCK;
    return (int2)(first, min(first + BLOCK, *count));
}

kernel void sum(constant int *count, global const float *a, global float2 *partials) {
    int2 block = block_of(count);
    if (block.x >= block.y) return;
    float2 sum = (float2)(0.0f);
    for (int i = block.x; i < block.y; i++) sum = added(sum, a[i]);
    partials[get_global_id(0)] = sum;
}

kernel void dot_product(constant int *count, global const float *a, global const float *b, global float2 *partials) {
    int2 block = block_of(count);
    if (block.x >= block.y) return;
    float2 sum = (float2)(0.0f);
    for (int i = block.x; i < block.y; i++) {
        float product = a[i] * b[i];
        sum = added(sum, product);
        sum.y += fma(a[i], b[i], -product);
    }
    partials[get_global_id(0)] = sum;
}

// The least and the greatest finite value; the first is above the second if there is none.
kernel void extremes(constant int *count, global const float *a, global float2 *partials) {
    int2 block = block_of(count);
    if (block.x >= block.y) return;
    float2 ends = (float2)(INFINITY, -INFINITY);
    for (int i = block.x; i < block.y; i++)
        if (isfinite(a[i])) ends = (float2)(fmin(ends.x, a[i]), fmax(ends.y, a[i]));
    partials[get_global_id(0)] = ends;
}

// The number of finite values per key. Keys are whole numbers of 32 bits in the order of the values; the upper half of each counts, or the lower
// half of those whose upper half is `upper`. Neighbours are often equal, so that a run of them is added at once.
kernel void count_keys(constant int *count, constant int *upper, global const float *a, global uint *counts) {
    int2 block = block_of(count);
    uint last = 0, run = 0;
    for (int i = block.x; i < block.y; i++) {
        uint bits = as_uint(a[i]), key = bits ^ (bits >> 31 ? 0xffffffffu : 0x80000000u);
        if (!isfinite(a[i]) || (*upper >= 0 && key >> 16 != (uint)*upper)) continue;
        uint half_key = *upper >= 0 ? key & 0xffffu : key >> 16;
        if (half_key != last && run > 0) atomic_add(counts + last, run), run = 0;
        last = half_key, run++;
    }
    if (run > 0) atomic_add(counts + last, run);
}
