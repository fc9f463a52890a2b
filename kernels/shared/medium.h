// The media of photons: a box, cut into the cells of a DDA (dda.h). MEDIA selects the place of the media,
//   UNIFORM  one everywhere               LABELS   one per voxel, by its number
//   LAYERS   one per layer along z        DENSITY  one whose extinction is times a voxel's density
#ifndef SHARED_MEDIUM_H
#define SHARED_MEDIUM_H

#include "shared/dda.h"
#include "shared/lanes.h"
#include "shared/phase.h"

#define VOXEL_CELLS (TRACKING == TRACKING_EXACT && (MEDIA == MEDIA_LABELS || MEDIA == MEDIA_DENSITY))
#define LAYER_CELLS (TRACKING == TRACKING_EXACT && MEDIA == MEDIA_LAYERS)
#define BLOCK_CELLS (BY_MAJORANTS)
// With labels a photon knows the clearance of its voxel: all voxels within it have the same label, and are crossed in one step.
#define HAS_CLEARANCE (VOXEL_CELLS && MEDIA == MEDIA_LABELS)

static inline Int cell_axis(constant const PhotonTransport *params, int axis, Real p) {
    return cell_on_axis(p, params->low_mm[axis], params->cells_per_mm[axis], params->cells[axis]);
}

static inline Int layer_at(constant const PhotonTransport *params, global const float *table, Real z) {
    Int layer = (Int)(0);
    for (int i = 1; i < params->layers; i++) layer -= MASK(z >= table[params->at_layers + i]);
    return layer;
}

static inline Cell cell_at(constant const PhotonTransport *params, global const float *table, Real3 p) {
    Cell c;
#if VOXEL_CELLS || BLOCK_CELLS
    c.x = cell_axis(params, 0, p.x), c.y = cell_axis(params, 1, p.y), c.z = cell_axis(params, 2, p.z);
#else
    c.x = c.y = c.z = (Int)(0);
#endif
#if LAYER_CELLS
    c.z = layer_at(params, table, p.z);
#endif
    return c;
}

// The last cell along an axis within the clearance.
static inline Int cell_ahead(constant const PhotonTransport *params, int axis, Int cell, Int clearance, Mask up) {
#if HAS_CLEARANCE
    return clamp(select(cell - clearance, cell + clearance, up), (Int)(0), (Int)(params->cells[axis] - 1));
#else
    return cell;
#endif
}

// The boundary ahead of a cell along an axis.
static inline Real boundary_ahead(constant const PhotonTransport *params, global const float *table, int axis, Int cell, Mask up) {
#if LAYER_CELLS
    if (axis == 2) return gather_reals(table + params->at_layers, select(cell, cell + 1, up));
#endif
#if VOXEL_CELLS || BLOCK_CELLS
    return boundary_on_axis(cell, up, params->low_mm[axis], params->cell_mm[axis], params->high_mm[axis], params->cells[axis]);
#else
    return select((Real)(params->low_mm[axis]), (Real)(params->high_mm[axis]), up);
#endif
}

// The voxel of the grid at a point; a point beyond the grid has the nearest voxel at its edge.
static inline Int voxel_at(constant const PhotonTransport *params, Real3 p) {
    Int x = to_int(floor(p.x * params->voxels_per_mm[0])), y = to_int(floor(p.y * params->voxels_per_mm[1]));
    Int z = to_int(floor(p.z * params->voxels_per_mm[2]));
    x = clamp(x, (Int)(0), (Int)(params->grid[0] - 1)), y = clamp(y, (Int)(0), (Int)(params->grid[1] - 1));
    z = clamp(z, (Int)(0), (Int)(params->grid[2] - 1));
    return (z * params->grid[1] + y) * params->grid[0] + x;
}

static inline Int cell_voxel(constant const PhotonTransport *params, Cell c) {
    return (c.z * params->grid[1] + c.y) * params->grid[0] + c.x;
}

#if HAS_CLEARANCE
// The voxel at a point, limited to the clearance of a cell: rounding must not lead beyond it.
static inline Cell cell_within(constant const PhotonTransport *params, Cell c, Int clearance, Real3 p) {
    Cell at = cell_at(params, 0, p);
    at.x = clamp(at.x, c.x - clearance, c.x + clearance), at.y = clamp(at.y, c.y - clearance, c.y + clearance), at.z = clamp(at.z, c.z - clearance, c.z + clearance);
    return at;
}

// The medium and clearance of a voxel, in the lanes of `moved`. The others read voxel 0, which is in the cache.
static inline Int medium_and_clearance(constant const PhotonTransport *params, global const float *table, Cell c, Mask moved, Int *clearance) {
    Int voxel = select((Int)(0), cell_voxel(params, c), moved);
    Int word = gather_words((global const uchar *)(table + params->at_voxels), voxel * (params->label_bytes + 1));
    *clearance = (word >> (8 * params->label_bytes)) & 0xff;
    return word & (params->label_bytes == 1 ? 0xff : 0xffff);
}
#endif

// The medium of a cell or a point. If voxels or layers are the cells, the cell alone gives it.
static inline Int medium_of(constant const PhotonTransport *params, global const float *table, Cell c, Real3 p) {
#if MEDIA == MEDIA_LAYERS
    return LAYER_CELLS ? c.z : layer_at(params, table, p.z);
#elif HAS_CLEARANCE
    Int clearance;
    return medium_and_clearance(params, table, c, (Mask)(-1), &clearance);
#elif MEDIA == MEDIA_LABELS
    Int word = gather_words((global const uchar *)(table + params->at_voxels), voxel_at(params, p) * params->label_bytes);
    return word & (params->label_bytes == 1 ? 0xff : 0xffff);
#else
    return (Int)(0);
#endif
}

// One number of a medium. The table has one number of all media, then the next number; up to 16 of them fit in a register.
static inline Real medium_number(constant const PhotonTransport *params, global const float *table, Int medium, int number) {
#if MEDIA == MEDIA_UNIFORM || MEDIA == MEDIA_DENSITY
    return (Real)(table[number * params->media]);
#else
#if LANES == 16 && defined(__AVX512F__) && __has_builtin(__builtin_ia32_permvarsf512)
    if (params->media == 16) return __builtin_ia32_permvarsf512(vload16(number, table), medium);
#endif
    return gather_reals(table + number * params->media, medium);
#endif
}

// The refractive index of a medium.
static inline Real index_of(constant const PhotonTransport *params, global const float *table, Int medium) {
    return params->mismatch ? medium_number(params, table, medium, MEDIUM_INDEX) : (Real)(params->index);
}

static inline Medium medium_all(constant const PhotonTransport *params, global const float *table, Int medium) {
    Medium m;
    m.extinction = medium_number(params, table, medium, MEDIUM_EXTINCTION), m.albedo = medium_number(params, table, medium, MEDIUM_ALBEDO);
    m.kind = to_int(medium_number(params, table, medium, MEDIUM_PHASE));
    m.a = medium_number(params, table, medium, MEDIUM_PHASE_A), m.b = medium_number(params, table, medium, MEDIUM_PHASE_B);
    m.c = medium_number(params, table, medium, MEDIUM_PHASE_C);
    return m;
}

// The extinction of a medium in a cell, per mm.
static inline Real extinction_at(constant const PhotonTransport *params, global const float *table, Int medium, Cell c, Real3 p) {
    Real extinction = medium_number(params, table, medium, MEDIUM_EXTINCTION);
#if MEDIA == MEDIA_DENSITY
    Int voxel = VOXEL_CELLS ? cell_voxel(params, c) : voxel_at(params, p);
    extinction *= gather_reals(table + params->at_voxels, voxel);
#endif
    return extinction;
}

// The rate at which free paths end in the cell, per mm: the extinction, or the block's majorant.
static inline Real collision_rate(constant const PhotonTransport *params, global const float *table, Int medium, Cell c, Real3 p) {
#if BLOCK_CELLS
    return gather_reals(table + params->at_blocks, (c.z * params->cells[1] + c.y) * params->cells[0] + c.x);
#else
    return extinction_at(params, table, medium, c, p);
#endif
}

#endif
