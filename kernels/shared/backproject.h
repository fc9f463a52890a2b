// Backprojection of parallel views: the sum over views of the value at the voxel's place in them, interpolated linearly between bins.
#ifndef SHARED_BACKPROJECT_H
#define SHARED_BACKPROJECT_H

#include "shared/lanes.h"

// Packets of a work-item.
#define PACKETS (LANES == 1 ? 1 : 4)

// The lanes of v by their numbers, which are taken modulo LANES where they are beyond. One instruction if clang has it.
static inline Real permuted(Real v, Int lane) {
#if LANES == 1
    return v;
#elif LANES == 16 && defined(__AVX512F__) && __has_builtin(__builtin_ia32_permvarsf512)
    return __builtin_ia32_permvarsf512(v, lane);
#elif LANES == 8 && defined(__AVX2__) && __has_builtin(__builtin_ia32_permvarsf256)
    return __builtin_ia32_permvarsf256(v, lane);
#else
    RealLanes from, to;
    IntLanes at;
    from.v = v, at.v = lane;
    for (int i = 0; i < LANES; i++) to.lane[i] = from.lane[at.lane[i] & (LANES - 1)];
    return to.v;
#endif
}

// A row's values at the places `u`, in bins, `least` of which is the least. Rows have MARGIN zeros on each side, so that nothing beyond them is read.
// Lanes that are at most a bin apart share two loads, of a packet of bins and of the next ones: shuffles in registers are faster than gathers.
static inline Real at_bins(constant BackprojectionPass *pass, global const float *row, Real u, float least, int is_near) {
    Real part;
    if (is_near) {
        // The floor: PoCL's own for a scalar takes branches.
        int whole = (int)least, first = clamp(whole - (least < (float)whole), 1 - MARGIN, pass->bins[0]);
        Real place = u - (float)first;
        // By rounding, the last place may be LANES.
        Int lane = min(to_int(place), (Int)(LANES - 1));
        part = place - to_real(lane);
        Real here = permuted(REALS_AT(row + first), lane), next = permuted(REALS_AT(row + first + 1), lane);
        return mad(part, next - here, here);
    }
    Real place = fmin(fmax(u, (Real)(-1.0f)), (Real)((float)pass->bins[0])) + 1.0f;
    Int bin = to_int(place), here, next;
    part = place - to_real(bin);
    gather_pairs((global const uchar *)(row - 1), bin << 2, &here, &next);
    return mad(part, as_Real(next) - as_Real(here), as_Real(here));
}

// Adds a packet's sum to a row of voxels of the grid.
static inline void add_packet(constant BackprojectionPass *pass, global float *row, int x, Real sum) {
    if (x + LANES <= pass->dims[0]) {
        ((global UnalignedReal *)(row + x))->lanes += sum;
        return;
    }
    RealLanes lanes;
    lanes.v = sum;
    for (int i = 0; x + i < pass->dims[0]; i++) row[x + i] += lanes.lane[i];
}

// Adds the views of a block to PACKETS packets of voxels along x, which share what a view and a row of voxels have in common. Planes that are within half
// a bin of the outermost rows have their values; those farther away have no data.
static inline void backproject(constant BackprojectionPass *pass, global const BackprojectionView *views, global const float *rows, global float *grid) {
    int x = (int)get_global_id(0) * (LANES * PACKETS), number = pass->first_row + (int)get_global_id(1);
    if (x >= pass->dims[0] || number >= pass->end_row) return;
    int y = number % pass->dims[1], z = number / pass->dims[1], last = pass->bins[1] - 1;
    float v = mad((float)z, pass->v_step, pass->v_first);
    if (v < -0.5f || v > (float)last + 0.5f) return;
    v = fmin(fmax(v, 0.0f), (float)last);
    int below = (int)v, above = min(below + 1, last);
    float part = v - (float)below;
    Real column = to_real(x + LANE_IDS), sums[PACKETS];
    for (int p = 0; p < PACKETS; p++) sums[p] = (Real)(0.0f);
    global const float *row = rows + MARGIN;
    for (int i = 0; i < pass->views; i++, row += pass->stride * pass->bins[1]) {
        float along = views[i].along_x, at_row = mad((float)y, views[i].along_y, views[i].first);
        Real u = mad(column, (Real)(along), (Real)(at_row));
        float least = mad((float)(along < 0.0f ? x + LANES - 1 : x), along, at_row);
        int is_near = LANES >= 8 && fabs(along) <= 1.0f;
#pragma unroll
        for (int p = 0; p < PACKETS; p++, u += along * LANES, least += along * LANES) {
            Real value = at_bins(pass, row + below * pass->stride, u, least, is_near);
            if (part > 0.0f) value = mad((Real)(part), at_bins(pass, row + above * pass->stride, u, least, is_near) - value, value);
            sums[p] += value;
        }
    }
    global float *to = grid + (size_t)number * pass->dims[0];
    for (int p = 0; p < PACKETS; p++)
        if (x + p * LANES < pass->dims[0]) add_packet(pass, to, x + p * LANES, sums[p]);
}

#endif
