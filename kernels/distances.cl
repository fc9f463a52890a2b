// The Chebyshev distance in cells from each macro-cell to the nearest occupied one, 0 if occupied, 255 for 255 or more. Each pass works along one
// axis (x, y, z), since the greatest of three differences can be taken one after the other. A cell is occupied if its range meets one of the
// intervals. One work-item is one line of cells along the pass's axis.

#include "shared/voxel.h"

static inline bool occupied(constant CellsPass *pass, global const float *intervals, global const Voxel *ranges, int cell) {
    float low = (float)ranges[2 * cell], high = (float)ranges[2 * cell + 1];
    if (!(low <= high)) return false;
    float more = pass->overshoot * (high - low);
    low -= more, high += more;
    for (int i = 0; i < pass->intervals; i++)
        if (low <= intervals[2 * i + 1] && high >= intervals[2 * i]) return true;
    return false;
}

kernel void distances(constant CellsPass *pass, global const float *intervals, global const Voxel *ranges, global const uchar *from,
                      global uchar *to) {
    int wide = (pass->dims[0] + CELL - 1) / CELL, high = (pass->dims[1] + CELL - 1) / CELL, deep = (pass->dims[2] + CELL - 1) / CELL;
    int line = (int)get_global_id(0), start, stride, count, lines;
    if (pass->axis == 0) {
        lines = high * deep, count = wide, stride = 1, start = line * wide;
    } else if (pass->axis == 1) {
        lines = wide * deep, count = high, stride = wide, start = line / wide * wide * high + line % wide;
    } else {
        lines = wide * high, count = deep, stride = wide * high, start = line;
    }
    if (line >= lines) return;
    if (pass->axis == 0) {
        int since = 255;
        for (int i = 0; i < count; i++) {
            since = occupied(pass, intervals, ranges, start + i) ? 0 : min(since + 1, 255);
            to[start + i] = (uchar)since;
        }
        for (int i = count - 1; i >= 0; i--) {
            since = to[start + i] == 0 ? 0 : min(since + 1, 255);
            to[start + i] = (uchar)min(since, (int)to[start + i]);
        }
        return;
    }
    for (int i = 0; i < count; i++) {
        int best = from[start + i * stride];
        for (int distance = 1; distance < best; distance++) {
            int before = i - distance >= 0 ? from[start + (i - distance) * stride] : 255;
            int after = i + distance < count ? from[start + (i + distance) * stride] : 255;
            if (i - distance < 0 && i + distance >= count) break;
            best = min(best, max(distance, min(before, after)));
        }
        to[start + i * stride] = (uchar)best;
    }
}
