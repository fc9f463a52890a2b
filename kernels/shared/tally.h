// Sums that do not depend on the order of addition: 64-bit integers in units of 2^-30.
#ifndef SHARED_TALLY_H
#define SHARED_TALLY_H

#include "shared/lanes.h"

static inline ULong fixed(Real amount) { return ulong_rounded(amount * FIXED_ONE); }

static inline void tally_fixed(global ulong *sums, Int cell, ULong amount, Mask active) {
    IntLanes to, on;
    ULongLanes value;
    to.v = cell, on.v = active, value.v = amount;
    for (int i = 0; i < LANES; i++)
        if (on.lane[i]) atom_add(&sums[to.lane[i]], value.lane[i]);
}

static inline void tally(global ulong *sums, Int cell, Real amount, Mask active) { tally_fixed(sums, cell, fixed(amount), active); }

// The ledger's entries are LEDGER_…; behind LEDGER_LENGTH of them is the histogram of exits: -z by radius and angle, then +z. Each work-item sums the
// first entries locally and adds its sums once: otherwise all cores would wait for the same addresses.
typedef struct { ULong sums[LEDGER_SCATTERINGS], path; UInt scatterings; } Gains;

static inline Gains no_gains(void) {
    Gains g;
    for (int i = 0; i < LEDGER_SCATTERINGS; i++) g.sums[i] = ulong_zero();
    g.path = ulong_zero(), g.scatterings = (UInt)(0u);
    return g;
}

static inline void gain(ULong *sum, Real amount, Mask active) {
    *sum = add_ulong(*sum, fixed(select((Real)(0.0f), amount, active)));
}

static inline void gains_flush(global ulong *ledger, const Gains *g) {
    for (int i = 0; i < LEDGER_SCATTERINGS; i++) tally_fixed(ledger, (Int)(i), g->sums[i], (Mask)(-1));
    tally_fixed(ledger, (Int)(LEDGER_SCATTERINGS), ulong_from(g->scatterings), (Mask)(-1));
    tally_fixed(ledger, (Int)(LEDGER_PATH), g->path, (Mask)(-1));
}

#endif
