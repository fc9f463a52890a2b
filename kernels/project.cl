// Projection of a volume along parallel rays by Joseph's method (IEEE Transactions on Medical Imaging 1, 1982): the sum over the planes of voxel centres
// across a ray's steepest axis, interpolated linearly in each plane, times the ray's length from plane to plane. Outside the grid is nothing.
//
// Item: a packet of bins of a row. Rays of a view are parallel, so the host finds the axis, and a ray's places in the planes are linear in bin and plane.

#include "shared/image.h"
#include "shared/lanes.h"
#include "shared/voxel.h"
#include "shared/voxel_lanes.h"

// The voxels on either side of a place along an axis of n voxels, as indices in the grid, with weights that are 0 outside.
typedef struct { Int low, high; Real of_low, of_high; } Sides;

static inline Sides sides(Real place, int n) {
    Real below = floor(place), part = place - below;
    Int low = to_int(below), high = low + 1, last = (Int)(n - 1);
    Sides s;
    s.of_low = select((Real)(0.0f), 1.0f - part, MASK(low >= 0) & MASK(low <= last));
    s.of_high = select((Real)(0.0f), part, MASK(high >= 0) & MASK(high <= last));
    s.low = clamp(low, (Int)(0), last), s.high = clamp(high, (Int)(0), last);
    return s;
}

// Narrows the planes from *from to *to to those in which start + plane * slope is between -1 and n.
static inline void narrow(Real start, float slope, int n, Real *from, Real *to) {
    if (slope == 0.0f) {
        *to = select(*to, (Real)(-1.0f), MASK(start <= -1.0f) | MASK(start >= (float)n));
        return;
    }
    Real enters = (-1.0f - start) / slope, leaves = ((float)n - start) / slope;
    *from = fmax(*from, fmin(enters, leaves)), *to = fmin(*to, fmax(enters, leaves));
}

// The value of a voxel in the given plane; that of nothing, if it has none.
static inline Real value_at(constant ProjectPass *pass, VOLUME voxels, int axis, Int plane, Int b, Int c) {
    Real raw = axis == 0 ? voxel_at(pass->dims, voxels, plane, b, c)
        : axis == 1 ? voxel_at(pass->dims, voxels, b, plane, c) : voxel_at(pass->dims, voxels, b, c, plane);
#if VOXEL == VOXEL_F32
    raw = select((Real)(pass->nothing), raw, MASK(raw == raw));
#endif
    return raw;
}

kernel void project(constant ProjectPass *pass, global const ProjectView *views, VOLUME voxels, global float *sinogram) {
    int x = (int)get_global_id(0) * LANES, row = pass->first_row + (int)get_global_id(1);
    if (x >= pass->bins[0] || row >= pass->end_row) return;
    global const ProjectView *view = views + row / pass->bins[1];
    int axis = view->axis, planes = pass->dims[axis];
    int across = pass->dims[axis == 0 ? 1 : 0], down = pass->dims[axis == 2 ? 1 : 2];
    Real u = to_real(x + LANE_IDS), v = (Real)((float)(row % pass->bins[1]));
    Real b = mad(u, (Real)(view->across[1]), mad(v, (Real)(view->across[2]), (Real)(view->across[0])));
    Real c = mad(u, (Real)(view->down[1]), mad(v, (Real)(view->down[2]), (Real)(view->down[0])));
    Real from = (Real)(0.0f), to = (Real)((float)(planes - 1));
    narrow(b, view->across[3], across, &from, &to);
    narrow(c, view->down[3], down, &from, &to);
    RealLanes first, last;
    first.v = from, last.v = to;
    float least = (float)planes, most = -1.0f;
    for (int i = 0; i < LANES; i++)
        if (first.lane[i] <= last.lane[i]) least = fmin(least, first.lane[i]), most = fmax(most, last.lane[i]);
    // A plane more on either side: what is outside has no weight.
    int begin = max((int)least - 1, 0), end = min((int)most + 1, planes - 1);
    Real sum = (Real)(0.0f), weights = sum;
    for (int plane = begin; plane <= end; plane++) {
        Sides s = sides(mad((Real)((float)plane), (Real)(view->across[3]), b), across);
        Sides t = sides(mad((Real)((float)plane), (Real)(view->down[3]), c), down);
        Int at = (Int)(plane);
        Real low = t.of_low * value_at(pass, voxels, axis, at, s.low, t.low) + t.of_high * value_at(pass, voxels, axis, at, s.low, t.high);
        Real high = t.of_low * value_at(pass, voxels, axis, at, s.high, t.low) + t.of_high * value_at(pass, voxels, axis, at, s.high, t.high);
        sum += s.of_low * low + s.of_high * high;
        weights = mad(s.of_low + s.of_high, t.of_low + t.of_high, weights);
    }
    RealLanes total;
    total.v = view->length * mad((Real)(pass->slope), sum, pass->inter * weights);
    global float *out = sinogram + (size_t)row * pass->bins[0] + x;
    for (int i = 0; i < LANES && x + i < pass->bins[0]; i++) out[i] = total.lane[i];
}
