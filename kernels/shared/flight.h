// Flights of light through a volume whose values are densities: the position, direction and throughput of each lane. Positions are in index units,
// lengths in world units. A free flight ends at a real collision, or at its exit from the volume; a ratio flight goes a given length and estimates
// the transmittance along it (tracker.h).
#ifndef SHARED_FLIGHT_H
#define SHARED_FLIGHT_H

#include "shared/dda.h"
#include "shared/lanes.h"
#include "shared/phase.h"
#include "shared/rng.h"

// A path of more collisions than this is cut and counted.
#define MOST_EVENTS 1000000u

typedef struct {
    Real3 p, d, way;     // position; direction, of unit length in the world; the same in index units per world unit
    Real3 inverse;       // 1 / way
    Cell cell;
    Real depth;          // the rest of the free path, in optical depth
    Real left;           // the length to the end of the flight
    Real3 throughput;    // of the path, or the light that a ratio flight brings
    Real weight;         // of the flight, which multiplies the throughput
    Mask ratio;
    uint sample;         // keys the random numbers, with
    UInt number, event;  // the pixel, and the number of events on its path
} Flight;

// Four random numbers of a path's next event; `what` numbers the draws of one event.
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
    f.p = f.d = f.way = f.inverse = f.throughput = real3(zero, zero, zero);
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

// Points the lanes of `aimed` along their d, from their p.
static inline void aim(constant const View *view, constant const Scattering *params, Mask aimed, Flight *f) {
    Real3 way = way_of(view, f->d);
    f->way = select3(f->way, way, aimed);
    f->inverse = select3(f->inverse, real3(1.0f / way.x, 1.0f / way.y, 1.0f / way.z), aimed);
    f->cell.x = select(f->cell.x, cell_on_axis(f->p.x, 0.0f, params->cells_per_voxel[0], params->cells[0]), aimed);
    f->cell.y = select(f->cell.y, cell_on_axis(f->p.y, 0.0f, params->cells_per_voxel[1], params->cells[1]), aimed);
    f->cell.z = select(f->cell.z, cell_on_axis(f->p.z, 0.0f, params->cells_per_voxel[2], params->cells[2]), aimed);
}

// Begins free flights of the lanes of `on` from p in the direction d with a throughput. They end at a collision or at the exit.
static inline void fly_on(Real3 p, Real3 d, Real3 throughput, Real depth, Mask on, Flight *f) {
    f->p = select3(f->p, p, on);
    f->d = select3(f->d, d, on);
    f->throughput = select3(f->throughput, throughput, on);
    f->weight = select(f->weight, (Real)(1.0f), on);
    f->depth = select(f->depth, depth, on);
    f->left = select(f->left, (Real)(1e30f), on);
    f->ratio &= ~on;
}

// Begins ratio flights along a length. Their weight becomes the transmittance.
static inline void fly_to(Real3 p, Real3 d, Real length, Real3 throughput, Real depth, Mask on, Flight *f) {
    fly_on(p, d, throughput, depth, on, f);
    f->left = select(f->left, length, on);
    f->ratio |= on;
}

#endif
