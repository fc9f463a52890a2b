// Flights of light through a volume whose values are densities: where each lane's light is, where it goes, and what it carries. Positions
// are in index units, lengths in world units. A free flight ends at a real collision, or where it leaves the volume; a ratio flight goes
// a given length and estimates the transmittance along it (tracker.h).
#ifndef SHARED_FLIGHT_H
#define SHARED_FLIGHT_H

#include "shared/lanes.h"
#include "shared/phase.h"
#include "shared/rng.h"
#include "shared/walls.h"

// A path of more collisions than this is cut and counted.
#define MOST_EVENTS 1000000u

typedef struct {
    Real3 p, d, way;     // place; direction, of unit length in the world; the same in index units per world unit
    Real3 inverse;       // 1 / way
    Cell cell;
    Real depth;          // what is left of the free path, in optical depth
    Real left;           // the length to the end of the flight
    Real3 carried;       // light, or what of it gets to the eye
    Real weight;         // what the flight makes of it
    Mask ratio;
    uint sample;         // keys the random numbers, with
    UInt number, event;  // the pixel, and what has happened on its path
} Flight;

// Four numbers of a path's next event; `what` tells the draws of one event apart.
static inline UInt4Lanes draw(constant const View *view, const Flight *f, uint what) {
    UInt4Lanes ctr = {f->number, (UInt)(f->sample), f->event, (UInt)(view->stream + 0x6c696700u + 16u * what)};
    return philox(ctr, view->seed[0], view->seed[1]);
}

static inline Medium phase_of(constant const Scattering *params) {
    Medium m;
    m.extinction = m.albedo = (Real)(1.0f);
    m.kind = (Int)((int)params->phase[0]);
    m.a = (Real)(params->phase[1]), m.b = (Real)(params->phase[2]), m.c = (Real)(params->phase[3]);
    return m;
}

static inline Real3 world_of(constant const Scattering *params, Real3 p) {
    constant const float *m = params->world_from_index;
    return real3(mad(m[0], p.x, mad(m[3], p.y, mad(m[6], p.z, (Real)(m[9])))), mad(m[1], p.x, mad(m[4], p.y, mad(m[7], p.z, (Real)(m[10])))),
                 mad(m[2], p.x, mad(m[5], p.y, mad(m[8], p.z, (Real)(m[11])))));
}

static inline Real3 by_colour(Real3 light, constant const float *colour) {
    return real3(light.x * colour[0], light.y * colour[1], light.z * colour[2]);
}

static inline Flight no_flight(uint sample) {
    Flight f;
    Real zero = (Real)(0.0f);
    f.p = f.d = f.way = f.inverse = f.carried = real3(zero, zero, zero);
    f.cell.x = f.cell.y = f.cell.z = (Int)(0);
    f.depth = f.left = f.weight = zero;
    f.ratio = (Mask)(0);
    f.sample = sample;
    f.number = f.event = (UInt)(0u);
    return f;
}

// A direction of the world in index units per world unit.
static inline Real3 way_of(constant const View *view, Real3 d) {
    constant const float *w = view->world_gradient_from_index;
    return real3(mad(w[0], d.x, mad(w[3], d.y, w[6] * d.z)), mad(w[1], d.x, mad(w[4], d.y, w[7] * d.z)), mad(w[2], d.x, mad(w[5], d.y, w[8] * d.z)));
}

// Points the lanes of `turned` along their d, from their p.
static inline void aim(constant const View *view, constant const Scattering *params, Mask turned, Flight *f) {
    Real3 way = way_of(view, f->d);
    f->way = select3(f->way, way, turned);
    f->inverse = select3(f->inverse, real3(1.0f / way.x, 1.0f / way.y, 1.0f / way.z), turned);
    f->cell.x = select(f->cell.x, cell_on_axis(f->p.x, 0.0f, params->walls_per_voxel[0], params->walls[0]), turned);
    f->cell.y = select(f->cell.y, cell_on_axis(f->p.y, 0.0f, params->walls_per_voxel[1], params->walls[1]), turned);
    f->cell.z = select(f->cell.z, cell_on_axis(f->p.z, 0.0f, params->walls_per_voxel[2], params->walls[2]), turned);
}

// Sends the lanes of `on` on from the place p in the direction d, with what they carry: freely, until they collide or leave.
static inline void fly_on(Real3 p, Real3 d, Real3 carried, Real depth, Mask on, Flight *f) {
    f->p = select3(f->p, p, on);
    f->d = select3(f->d, d, on);
    f->carried = select3(f->carried, carried, on);
    f->weight = select(f->weight, (Real)(1.0f), on);
    f->depth = select(f->depth, depth, on);
    f->left = select(f->left, (Real)(1e30f), on);
    f->ratio &= ~on;
}

// The same along a length, to see how much of it arrives.
static inline void fly_to(Real3 p, Real3 d, Real length, Real3 carried, Real depth, Mask on, Flight *f) {
    fly_on(p, d, carried, depth, on, f);
    f->left = select(f->left, length, on);
    f->ratio |= on;
}

#endif
