// Sums that do not depend on the order of addition: 64-bit integers in units of 2^-30.
#define FIXED_ONE 1073741824.0f

static inline ULong fixed(Real amount) { return as_ULong(to_long(rint(amount * FIXED_ONE))); }

static inline void tally_fixed(global ulong *sums, Int cell, ULong amount, Mask active) {
    IntLanes to, on;
    ULongLanes value;
    to.v = cell, on.v = active, value.v = amount;
    for (int i = 0; i < LANES; i++)
        if (on.lane[i]) atom_add(&sums[to.lane[i]], value.lane[i]);
}

static inline void tally(global ulong *sums, Int cell, Real amount, Mask active) { tally_fixed(sums, cell, fixed(amount), active); }

// A number of the ledger that most collisions add to: kept in registers and added once, for all cores would wait for its place.
static inline void gain(ULong *sum, Real amount, Mask active) { *sum += fixed(select((Real)(0.0f), amount, active)); }
