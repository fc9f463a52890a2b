// A volume in its own voxel type, x fastest. Index coordinates are cell-cornered: voxel i has its centre at i + 0.5 and
// the box is [0, n]; outside the outermost centres the edge value holds. The buffer is padded by 8 zero bytes.

#if VOXEL == VOXEL_U8
#define VOXEL_BYTES 1
#elif VOXEL == VOXEL_F32
#define VOXEL_BYTES 4
#else
#define VOXEL_BYTES 2
#endif

// Two neighbours in x, one load where their bits fit in a word: loads, not arithmetic, are what a sample costs.
static inline Real lerp_x(global const uchar *voxels, Int byte_offset, Real f) {
#if VOXEL == VOXEL_F32
    Real a = as_Real(gather_words(voxels, byte_offset)), b = as_Real(gather_words(voxels, byte_offset + 4));
#else
    Int pair = gather_words(voxels, byte_offset);
#if VOXEL == VOXEL_U8
    Real a = to_real(pair & 0xff), b = to_real((pair >> 8) & 0xff);
#elif VOXEL == VOXEL_I16
    Real a = to_real((pair << 16) >> 16), b = to_real(pair >> 16);
#else
    Real a = to_real(pair & 0xffff), b = to_real(as_Int(as_UInt(pair) >> 16));
#endif
#endif
    return mad(b - a, f, a);
}

// The raw value (before slope and intercept) at p, trilinear. A NaN voxel makes the whole of its eight cells NaN.
static inline Real sample_raw(constant const View *view, global const uchar *voxels, Real3 p) {
    int nx = view->dims[0], ny = view->dims[1], nz = view->dims[2];
    Real x = clamp(p.x - 0.5f, (Real)(0.0f), (Real)(nx - 1));
    Real y = clamp(p.y - 0.5f, (Real)(0.0f), (Real)(ny - 1));
    Real z = clamp(p.z - 0.5f, (Real)(0.0f), (Real)(nz - 1));
    Int ix = min(to_int(x), (Int)(max(nx - 2, 0))), iy = min(to_int(y), (Int)(max(ny - 2, 0))), iz = min(to_int(z), (Int)(max(nz - 2, 0)));
    Real fx = x - to_real(ix), fy = y - to_real(iy), fz = z - to_real(iz);
    int row = (ny > 1 ? nx : 0) * VOXEL_BYTES, sheet = (nz > 1 ? nx * ny : 0) * VOXEL_BYTES;
    Int at = ((iz * ny + iy) * nx + ix) * VOXEL_BYTES;
    Real near = lerp_x(voxels, at, fx), low = lerp_x(voxels, at + row, fx);
    Real far = lerp_x(voxels, at + sheet, fx), deep = lerp_x(voxels, at + (row + sheet), fx);
    Real front = mad(low - near, fy, near), back = mad(deep - far, fy, far);
    return mad(back - front, fz, front);
}

// The gradient of the raw value in index units, by central differences one voxel to each side.
static inline Real3 gradient_raw(constant const View *view, global const uchar *voxels, Real3 p) {
    Real3 g;
    g.x = sample_raw(view, voxels, real3(p.x + 1.0f, p.y, p.z)) - sample_raw(view, voxels, real3(p.x - 1.0f, p.y, p.z));
    g.y = sample_raw(view, voxels, real3(p.x, p.y + 1.0f, p.z)) - sample_raw(view, voxels, real3(p.x, p.y - 1.0f, p.z));
    g.z = sample_raw(view, voxels, real3(p.x, p.y, p.z + 1.0f)) - sample_raw(view, voxels, real3(p.x, p.y, p.z - 1.0f));
    return scale3(g, (Real)(0.5f));
}

// Macro-cells of 8^3 voxels: how many cells away the nearest occupied one is (Chebyshev), 0 where occupied.
static inline Int cell_distance(constant const View *view, global const uchar *distances, Int cx, Int cy, Int cz) {
    int wide = (view->dims[0] + 7) >> 3, high = (view->dims[1] + 7) >> 3;
    return gather_words(distances, (cz * high + cy) * wide + cx) & 0xff;
}

// The ray parameter at which p + s d leaves the block of cells that are known to be empty: `distance` - 1 cells around its own.
static inline Real leap_axis(Real p, Real d, Int cell, Int distance) {
    Real ahead = to_real((cell + distance) << 3), behind = to_real((cell - distance + 1) << 3);
    Real wall = select(behind, ahead, MASK(d > 0.0f));
    return select((wall - p) / d, (Real)(1e30f), MASK(fabs(d) < 1e-12f));
}
