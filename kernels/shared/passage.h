// Cell boundaries: the distances to them (DDA), and the passage of photons through them.
#ifndef SHARED_PASSAGE_H
#define SHARED_PASSAGE_H

#include "shared/dda.h"
#include "shared/fresnel.h"
#include "shared/lanes.h"
#include "shared/medium.h"
#include "shared/photon.h"
#include "shared/tally.h"

// Counts photons that leave the box by a face, by its radius from the beam's axis and its angle to the face.
static inline void leave(constant const PhotonTransport *params, global const float *table, global ulong *ledger, Gains *gains,
                         const Photon *photon, int axis, Mask up, Mask gone) {
    gain(&gains->sums[LEDGER_EXIT_MINUS_X + 2 * axis], photon->weight, gone & ~up);
    gain(&gains->sums[LEDGER_EXIT_MINUS_X + 2 * axis + 1], photon->weight, gone & up);
    if (axis != 2) return;
    Mask unscattered = gone & MASK(photon->scatterings == 0);
    if (any_lane(unscattered)) {
        gain(&gains->sums[LEDGER_UNSCATTERED_MINUS_Z], photon->weight, unscattered & ~up);
        gain(&gains->sums[LEDGER_UNSCATTERED_PLUS_Z], photon->weight, unscattered & up);
    }
    if (params->radius_bins == 0) return;
    Int side = select((Int)(0), (Int)(1), up);
    Real dx = photon->p.x - params->beam_mm[0], dy = photon->p.y - params->beam_mm[1], radius = sqrt(mad(dx, dx, dy * dy)), cosine = fabs(photon->d.z);
    Int ring = (Int)(-1), cone = (Int)(-1);
    for (int i = 0; i <= params->radius_bins; i++) ring -= MASK(radius >= table[params->at_radii + i]);
    for (int i = 0; i <= params->angle_bins; i++) cone -= MASK(cosine <= table[params->at_cosines + i]);
    Mask binned = gone & MASK(ring >= 0) & MASK(ring < params->radius_bins) & MASK(cone >= 0) & MASK(cone < params->angle_bins);
    tally(ledger, LEDGER_LENGTH + (side * params->radius_bins + ring) * params->angle_bins + cone, photon->weight, binned);
}

// Takes photons over a boundary across one axis, or turns them back there. Returns those that left the box.
static inline Mask cross_on_axis(constant const FieldPass *pass, constant const PhotonTransport *params, global const float *table,
                              global ulong *ledger, Gains *gains, int axis, Real boundary, Mask in, Photon *photon) {
    Real d = axis == 0 ? photon->d.x : axis == 1 ? photon->d.y : photon->d.z;
    Int here = axis == 0 ? photon->cell.x : axis == 1 ? photon->cell.y : photon->cell.z;
    Mask up = MASK(d > 0.0f), back = (Mask)(0);
    Int next = here + select((Int)(-1), (Int)(1), up);
    Mask out = in & (MASK(next < 0) | MASK(next >= params->cells[axis]));
    Real position = boundary;
    if (params->boundary[axis] == BOUNDARY_MIRROR) back = out;
    if (params->boundary[axis] == BOUNDARY_CYCLIC) {
        next = select(next, select((Int)(params->cells[axis] - 1), (Int)(0), up), out);
        position = select(position, select((Real)(params->high_mm[axis]), (Real)(params->low_mm[axis]), up), out);
    }
    if (params->boundary[axis] != BOUNDARY_ABSORBING) out = (Mask)(0);
    if ((params->fresnel && any_lane(out)) || params->mismatch) {
        Cell ahead = photon->cell;
        Int inside = clamp(next, (Int)(0), (Int)(params->cells[axis] - 1));
        if (axis == 0) ahead.x = inside;
        if (axis == 1) ahead.y = inside;
        if (axis == 2) ahead.z = inside;
        Real before = index_of(params, table, medium_of(params, table, photon->cell, photon->p));
        Real after = select(index_of(params, table, medium_of(params, table, ahead, photon->p)), (Real)(params->outside_index), out);
        Mask bends = in & ~back & MASK(before != after) & (params->fresnel ? (Mask)(-1) : ~out);
        if (any_lane(bends)) {
            Real eta = before / after, cos_out, reflected = fresnel(fabs(d), eta, &cos_out);
            Mask returns = bends & MASK(unit_open(draw(pass, photon, 2).a) < reflected);
            photon->event += as_UInt(select((Int)(0), (Int)(1), bends));
            Mask through = bends & ~returns;
            Real3 bent = scale3(photon->d, eta);
            if (axis == 0) bent.x = copysign(cos_out, d);
            if (axis == 1) bent.y = copysign(cos_out, d);
            if (axis == 2) bent.z = copysign(cos_out, d);
            photon->d = select3(photon->d, scale3(bent, rsqrt(fmax(dot3(bent, bent), (Real)(1e-20f)))), through);
            back |= returns;
        }
    }
    // A photon that is sent back stays on this side.
    position = select(position, boundary, back);
    if (axis == 0) photon->p.x = select(photon->p.x, position, in);
    if (axis == 1) photon->p.y = select(photon->p.y, position, in);
    if (axis == 2) photon->p.z = select(photon->p.z, position, in);
    if (axis == 0) photon->d.x = select(photon->d.x, -photon->d.x, back);
    if (axis == 1) photon->d.y = select(photon->d.y, -photon->d.y, back);
    if (axis == 2) photon->d.z = select(photon->d.z, -photon->d.z, back);
    Mask gone = out & ~back, moves = in & ~back & ~gone;
    if (any_lane(gone)) leave(params, table, ledger, gains, photon, axis, up, gone);
    if (axis == 0) photon->cell.x = select(photon->cell.x, next, moves);
    if (axis == 1) photon->cell.y = select(photon->cell.y, next, moves);
    if (axis == 2) photon->cell.z = select(photon->cell.z, next, moves);
    return gone;
}

// The boundaries ahead of a photon: their positions, the distances to them along its way, and the cells before them.
typedef struct { Real3 boundary, distance; Real nearest; Cell last; Mask up_x, up_y, up_z; } Ahead;

static inline Ahead boundaries_ahead(constant const PhotonTransport *params, global const float *table, const Photon *photon) {
    Ahead a;
    #define AXIS(i, c)                                                                                                     \
        a.up_##c = MASK(photon->d.c > 0.0f);                                                                               \
        a.last.c = cell_ahead(params, i, photon->cell.c, photon->clearance, a.up_##c);                                         \
        a.boundary.c = boundary_ahead(params, table, i, a.last.c, a.up_##c);                                                       \
        a.distance.c = distance_to(a.boundary.c, photon->p.c, photon->d.c);
    AXIS(0, x)
    AXIS(1, y)
    AXIS(2, z)
    #undef AXIS
    a.nearest = fmin(a.distance.x, fmin(a.distance.y, a.distance.z));
    return a;
}

// Takes photons over a boundary across one axis, if there are more cells behind it and no light is bent. Returns those that are left to
// cross_on_axis.
static inline Mask cross_inner(constant const PhotonTransport *params, int axis, Real boundary, Mask up, Mask in, Real *p, Int *cell) {
    if (params->mismatch) return in;
    Int next = *cell + select((Int)(-1), (Int)(1), up);
    Mask moves = in & MASK(next >= 0) & MASK(next < params->cells[axis]);
    *p = select(*p, boundary, moves);
    *cell = select(*cell, next, moves);
    return in & ~moves;
}

// Takes photons over their nearest boundary. Returns those that left the box.
static inline Mask cross(constant const FieldPass *pass, constant const PhotonTransport *params, global const float *table, global ulong *ledger,
                         Gains *gains, const Ahead *a, Mask crosses, Photon *photon) {
    Mask gone = (Mask)(0), in_x = crosses & MASK(a->distance.x == a->nearest);
    Mask in_y = crosses & ~in_x & MASK(a->distance.y == a->nearest), in_z = crosses & ~in_x & ~in_y;
#if HAS_CLEARANCE
    Cell here = cell_within(params, photon->cell, photon->clearance, photon->p);
    photon->cell.x = select(photon->cell.x, select(here.x, a->last.x, in_x), crosses);
    photon->cell.y = select(photon->cell.y, select(here.y, a->last.y, in_y), crosses);
    photon->cell.z = select(photon->cell.z, select(here.z, a->last.z, in_z), crosses);
#endif
#if VOXEL_CELLS || BLOCK_CELLS
    in_x = cross_inner(params, 0, a->boundary.x, a->up_x, in_x, &photon->p.x, &photon->cell.x);
    in_y = cross_inner(params, 1, a->boundary.y, a->up_y, in_y, &photon->p.y, &photon->cell.y);
    in_z = cross_inner(params, 2, a->boundary.z, a->up_z, in_z, &photon->p.z, &photon->cell.z);
#endif
    if (any_lane(in_x)) gone |= cross_on_axis(pass, params, table, ledger, gains, 0, a->boundary.x, in_x, photon);
    if (any_lane(in_y)) gone |= cross_on_axis(pass, params, table, ledger, gains, 1, a->boundary.y, in_y, photon);
    if (any_lane(in_z)) gone |= cross_on_axis(pass, params, table, ledger, gains, 2, a->boundary.z, in_z, photon);
#if HAS_CLEARANCE
    update_clearance(params, table, crosses, photon);
#endif
    return gone;
}

#endif
