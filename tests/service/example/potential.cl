// Jacobi's iteration for Laplace's equation between two plates: u is 0 on the face at the least z and 1 on the face at the greatest; its
// derivative across the other faces is 0. One work-item is one voxel of some planes of the grid.

// The potential of a neighbour. Beyond a plate it is mirrored about the plate's potential, beyond another face about the face.
static inline float neighbour(constant PotentialPass *pass, global const float *u, int x, int y, int z) {
    x = clamp(x, 0, pass->dims[0] - 1), y = clamp(y, 0, pass->dims[1] - 1);
    int inside = clamp(z, 0, pass->dims[2] - 1);
    float value = u[(inside * pass->dims[1] + y) * pass->dims[0] + x];
    return z < 0 ? -value : z > inside ? 2.0f - value : value;
}

kernel void relax(constant PotentialPass *pass, global const float *u, global float *next, global float *change) {
    int x = (int)get_global_id(0), y = (int)get_global_id(1), z = pass->first_plane + (int)get_global_id(2);
    if (x >= pass->dims[0] || y >= pass->dims[1] || z >= pass->end_plane) return;
    float sum = 0.0f;
    for (int side = -1; side <= 1; side += 2)
        sum += neighbour(pass, u, x + side, y, z) + neighbour(pass, u, x, y + side, z) + neighbour(pass, u, x, y, z + side);
    int voxel = (z * pass->dims[1] + y) * pass->dims[0] + x;
    next[voxel] = sum * (1.0f / 6.0f);
    change[voxel] = next[voxel] - u[voxel];
}
