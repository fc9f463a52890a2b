// Macro-cells: the least and greatest voxel that a sample in each block of CELL^3 voxels can read. Trilinear interpolation in
// the samples [CELL c, CELL c + CELL) reads the voxels CELL c - 1 .. CELL c + CELL. One work-item is one row of cells in x.
// In a cell of NaN only, the least is above the greatest.

#include "shared/voxel.h"

kernel void cells(constant CellsPass *pass, global const Voxel *voxels, global Voxel *ranges) {
    int nx = pass->dims[0], ny = pass->dims[1], nz = pass->dims[2];
    int wide = (nx + CELL - 1) / CELL, high = (ny + CELL - 1) / CELL, deep = (nz + CELL - 1) / CELL;
    int row = (int)get_global_id(0);
    if (row >= high * deep) return;
    int y0 = max(row % high * CELL - 1, 0), y1 = min(row % high * CELL + CELL, ny - 1);
    int z0 = max(row / high * CELL - 1, 0), z1 = min(row / high * CELL + CELL, nz - 1);
    for (int c = 0; c < wide; c++) {
        int x0 = max(c * CELL - 1, 0), x1 = min(c * CELL + CELL, nx - 1);
#if VOXEL == VOXEL_F32
        Voxel low = INFINITY, high_value = -INFINITY;
#else
        Voxel low = voxels[((size_t)z0 * ny + y0) * nx + x0], high_value = low;
#endif
        for (int z = z0; z <= z1; z++)
            for (int y = y0; y <= y1; y++) {
                global const Voxel *line = voxels + ((size_t)z * ny + y) * nx;
                for (int x = x0; x <= x1; x++) {
                    Voxel v = line[x];
                    low = v < low ? v : low;
                    high_value = v > high_value ? v : high_value;
                }
            }
        ranges[2 * (row * wide + c)] = low;
        ranges[2 * (row * wide + c) + 1] = high_value;
    }
}
