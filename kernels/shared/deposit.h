// Adds deposits of photons to the grid: at collisions, or along their tracks.
#ifndef SHARED_DEPOSIT_H
#define SHARED_DEPOSIT_H

#include "shared/dda.h"
#include "shared/lanes.h"
#include "shared/medium.h"
#include "shared/tally.h"

// The grid's sums. If the work-item owns them, it needs neither atomics nor branches, and each deposit is added together with the next one: its
// addresses, which are all over the grid, are fetched meanwhile. Waiting for them took a third of the time.
typedef struct { global ulong *sums; int own; Int idle; IntLanes to; ULongLanes amount; } Grid;

// Clang has the prefetch builtin if it compiles for a processor; oclgrind, which compiles for none, does not.
#if LANES > 1 && (defined(__x86_64__) || defined(__aarch64__))
#define FETCH_TO_WRITE(address) __builtin_prefetch((const void *)(size_t)(address), 1)
#else
#define FETCH_TO_WRITE(address)
#endif

static inline Grid grid_at(global ulong *sums, int own, int voxels) {
    Grid g;
    g.sums = sums, g.own = own;
    // Idle lanes add 0 at addresses of their own: at a common one they would wait for each other.
    g.idle = LANE_IDS % (Int)(voxels);
    g.to.v = g.idle, g.amount.v = ulong_zero();
    return g;
}

// Adds the deposit that waits.
static inline void grid_flush(Grid *g) {
    for (int i = 0; i < LANES; i++) g->sums[g->to.lane[i]] += g->amount.lane[i];
}

static inline void grid_add(Grid *g, Int voxel, ULong amount, Mask active) {
    if (!g->own) {
        tally_fixed(g->sums, voxel, amount, active);
        return;
    }
    grid_flush(g);
    g->to.v = select(g->idle, voxel, active), g->amount.v = ulong_where(active, amount);
    for (int i = 0; i < LANES; i++) FETCH_TO_WRITE(&g->sums[g->to.lane[i]]);
}

// Adds a collision's deposit to the grid.
static inline void deposit(constant const PhotonTransport *params, Grid *grid, Int voxel, Real3 p, ULong amount, Mask hit) {
    // Layers and boundaries without an end extend beyond the grid.
    if (params->endless) {
        hit &= MASK(p.x >= 0.0f) & MASK(p.x <= params->size_mm[0]) & MASK(p.y >= 0.0f) & MASK(p.y <= params->size_mm[1]);
        hit &= MASK(p.z >= 0.0f) & MASK(p.z <= params->size_mm[2]);
    }
    grid_add(grid, voxel, amount, hit);
}

#if !VOXEL_CELLS
// The lanes whose voxel is outside of the grid on the side towards which the flight goes.
static inline Mask beyond(Int voxel, Int up, int voxels) { return select(MASK(voxel < 0), MASK(voxel >= voxels), MASK(up != 0)); }

// Distributes a straight flight over the voxels that it crosses: weight times length, times the absorption for absorbed energy.
static inline void deposit_track(constant const PhotonTransport *params, global const float *table, Grid *grid, Real3 p, Real3 d,
                                 Real length, Real weight, Mask on) {
    Real t = (Real)(0.0f);
    // Planes have the numbers of their voxels, so that no plane is met twice.
    Int x = to_int(floor(p.x * params->voxels_per_mm[0])), y = to_int(floor(p.y * params->voxels_per_mm[1])), z = to_int(floor(p.z * params->voxels_per_mm[2]));
    Int up_x = -MASK(d.x > 0.0f), up_y = -MASK(d.y > 0.0f), up_z = -MASK(d.z > 0.0f);
    for (int i = 0; i < params->most_steps && any_lane(on); i++) {
        Real tx = (to_real(x + up_x) * params->voxel_mm[0] - p.x) / d.x, ty = (to_real(y + up_y) * params->voxel_mm[1] - p.y) / d.y;
        Real tz = (to_real(z + up_z) * params->voxel_mm[2] - p.z) / d.z;
        tx = select(tx, (Real)(1e30f), MASK(fabs(d.x) < 1e-12f)), ty = select(ty, (Real)(1e30f), MASK(fabs(d.y) < 1e-12f));
        tz = select(tz, (Real)(1e30f), MASK(fabs(d.z) < 1e-12f));
        Real to = fmin(fmin(tx, ty), fmin(tz, length)), part = fmax(to - t, (Real)(0.0f));
        Mask inside = on & MASK(x >= 0) & MASK(x < params->grid[0]) & MASK(y >= 0) & MASK(y < params->grid[1]) & MASK(z >= 0) & MASK(z < params->grid[2]);
        if (any_lane(inside)) {
            Real amount = weight * part * params->deposit_scale;
            Real3 middle = along(p, d, t + 0.5f * part);
            Int voxel = (z * params->grid[1] + y) * params->grid[0] + x;
            if (params->tally == TALLY_ABSORBED_TRACK) {
                Cell c = cell_at(params, table, middle);
                Int medium = medium_of(params, table, c, middle);
                amount *= extinction_at(params, table, medium, c, middle) * (1.0f - medium_number(params, table, medium, MEDIUM_ALBEDO));
            }
            grid_add(grid, voxel, fixed(amount), inside);
        }
        Mask in_x = on & MASK(tx <= to), in_y = on & MASK(ty <= to), in_z = on & MASK(tz <= to);
        x += select((Int)(0), up_x + up_x - 1, in_x), y += select((Int)(0), up_y + up_y - 1, in_y), z += select((Int)(0), up_z + up_z - 1, in_z);
        t = select(t, to, on);
        // A straight flight that has left the grid does not come back.
        on &= MASK(to < length) & ~(beyond(x, up_x, params->grid[0]) | beyond(y, up_y, params->grid[1]) | beyond(z, up_z, params->grid[2]));
    }
}
#endif

#endif
