// Photons through a grid of extinction: free paths by optical depth, exact from voxel to voxel, isotropic scattering,
// absorption by weight, Russian roulette for weights that no longer matter (it keeps the mean, an energy cut-off does not).
//   -ln(u) = integral of sigma ds  (Amanatides & Woo, Eurographics 1987, for the voxels)
// One work-item carries a packet of photons; a lane whose photon has ended takes the next of its own share.
// Sums are 64-bit integers in units of 2^-30, so that they do not depend on the order of addition.

#define FIXED_ONE 1073741824.0f

#define LEDGER_EXIT 0
#define LEDGER_ABSORBED 6
#define LEDGER_LOST 7
#define LEDGER_SCATTERINGS 8
#define LEDGER_FAULTS 9
#define LEDGER_PATH 10

// A photon that takes more steps than this through voxels has met a fault of arithmetic and is counted as lost.
#define MOST_STEPS 100000

static inline void tally(global ulong *sums, Int cell, Real amount, Mask active) {
    IntLanes to, on;
    RealLanes value;
    to.v = cell, on.v = active, value.v = amount;
    for (int i = 0; i < LANES; i++)
        if (on.lane[i]) atom_add(&sums[to.lane[i]], (ulong)convert_long_rte(value.lane[i] * FIXED_ONE));
}

typedef struct {
    Real3 p, d;            // grid units; grid units per unit of length
    Int x, y, z;           // the voxel
    Real weight, depth;    // what is left of the photon, and of its free path in optical depth
    UInt number;           // photon number within the item's lane
    UInt event;            // numbers the random numbers of this photon
} Photon;

static inline UInt4Lanes draw(constant const FieldPass *pass, const Photon *photon, UInt lane_first) {
    UInt low = pass->first[0] + lane_first + photon->number;
    UInt high = pass->first[1] + as_UInt(select((Int)(0), (Int)(1), MASK(low < pass->first[0])));
    UInt4Lanes ctr = {low, high, photon->event, (UInt)(0x70686f74u)};
    return philox(ctr, pass->seed[0], pass->seed[1]);
}

static inline Real3 isotropic(Real u, Real v, float cos_from) {
    Real cos_theta = mad(u, (Real)(1.0f - cos_from), (Real)(cos_from));
    Real sin_theta = sqrt(fmax((Real)(0.0f), 1.0f - cos_theta * cos_theta)), phi = 6.28318530717958648f * v;
    return real3(sin_theta * cos(phi), sin_theta * sin(phi), cos_theta);
}

// From a frame whose z is `axis` (unit length) to the grid's: Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017.
static inline Real3 turn_to(constant const float *axis, Real3 v) {
    float s = copysign(1.0f, axis[2]), a = -1.0f / (s + axis[2]), b = axis[0] * axis[1] * a;
    return real3(v.x * (1.0f + s * axis[0] * axis[0] * a) + v.y * b + v.z * axis[0],
                 v.x * (s * b) + v.y * (s + axis[1] * axis[1] * a) + v.z * axis[1],
                 v.x * (-s * axis[0]) + v.y * (-axis[1]) + v.z * axis[2]);
}

static inline Real3 per_length(constant const PhotonTransport *params, Real3 d) {
    return real3(d.x * params->cells_per_mm[0], d.y * params->cells_per_mm[1], d.z * params->cells_per_mm[2]);
}

// Puts new photons at the source in the lanes of `fresh`.
static inline void emit(constant const FieldPass *pass, constant const PhotonTransport *params, UInt lane_first, Mask fresh, Photon *photon) {
    photon->event = select(photon->event, (UInt)(0u), as_UInt(fresh));
    UInt4Lanes r = draw(pass, photon, lane_first);
    Real3 d = turn_to(params->source_axis, isotropic(unit_open(r.a), unit_open(r.b), params->source_cos_from));
    constant const float *at = params->source;
    photon->p = select3(photon->p, real3(at[0], at[1], at[2]), fresh);
    photon->d = select3(photon->d, per_length(params, d), fresh);
    photon->x = select(photon->x, (Int)(clamp((int)at[0], 0, params->grid[0] - 1)), fresh);
    photon->y = select(photon->y, (Int)(clamp((int)at[1], 0, params->grid[1] - 1)), fresh);
    photon->z = select(photon->z, (Int)(clamp((int)at[2], 0, params->grid[2] - 1)), fresh);
    photon->weight = select(photon->weight, (Real)(1.0f), fresh);
    photon->depth = select(photon->depth, -log(unit_open(r.c)), fresh);
    photon->event += as_UInt(select((Int)(0), (Int)(1), fresh));
}

// Distance to the wall of voxel `cell` ahead, along one axis.
static inline Real wall(Real p, Real d, Int cell) {
    Real to = to_real(select(cell, cell + 1, MASK(d > 0.0f)));
    return select(fmax((to - p) / d, (Real)(0.0f)), (Real)(1e30f), MASK(fabs(d) < 1e-12f));
}

// Scatters, absorbs and plays roulette in the lanes of `hit`; returns the lanes that go on.
static inline Mask collide(constant const FieldPass *pass, constant const PhotonTransport *params, UInt lane_first, Real sigma, Int cell,
                           Mask hit, global ulong *grid, global ulong *ledger, Photon *photon) {
    UInt4Lanes r = draw(pass, photon, lane_first);
    Real absorbed = photon->weight * (1.0f - params->albedo);
    if (params->tally == TALLY_ABSORBED) tally(grid, cell, absorbed, hit);
    if (params->tally == TALLY_FLUENCE_COLLISION) tally(grid, cell, photon->weight * params->cells_per_mm[0] / sigma, hit);
    tally(ledger, (Int)(LEDGER_ABSORBED), absorbed, hit);
    Real left = photon->weight - absorbed;
    Mask faint = MASK(left < params->roulette_threshold) & hit;
    Mask survives = MASK(unit_open(r.d) < params->roulette_survival);
    Real gained = select((Real)(0.0f), left / params->roulette_survival, survives);
    tally(ledger, (Int)(LEDGER_LOST), left - gained, faint);
    left = select(left, gained, faint);
    Mask goes_on = hit & (~faint | survives) & MASK(left > 0.0f);
    photon->weight = select(photon->weight, left, hit);
    photon->d = select3(photon->d, per_length(params, isotropic(unit_open(r.a), unit_open(r.b), -1.0f)), goes_on);
    photon->depth = select(photon->depth, -log(unit_open(r.c)), goes_on);
    photon->event += as_UInt(select((Int)(0), (Int)(1), hit));
    return goes_on;
}

kernel void photon_transport(constant FieldPass *pass, constant PhotonTransport *params, global const float *extinction_per_mm,
                             global ulong *grid, global ulong *ledger) {
    uint item = (uint)get_global_id(0);
    if ((ulong)item * (LANES * pass->per_lane) >= pass->count) return;
    UInt lane_first = item * (LANES * pass->per_lane) + as_UInt((Int)(LANE_IDS)) * pass->per_lane;
    int nx = params->grid[0], ny = params->grid[1], nz = params->grid[2];

    Photon photon;
    photon.p = photon.d = real3(0.0f, 0.0f, 0.0f);
    photon.x = photon.y = photon.z = (Int)(0);
    photon.weight = photon.depth = (Real)(0.0f);
    photon.number = photon.event = (UInt)(0u);
    // The last item of a launch may have fewer photons than lanes: never one too many.
    Int share = as_Int(min((UInt)(pass->count) - min(lane_first, (UInt)(pass->count)), (UInt)(pass->per_lane)));
    Int left = share, steps = (Int)(0);
    Mask alive = (Mask)(0);
    UInt scatterings = (UInt)(0u);
    Real path = (Real)(0.0f);

    for (;;) {
        Mask fresh = ~alive & MASK(left > 0);
        if (any_lane(fresh)) {
            photon.number = as_UInt(select(as_Int(photon.number), share - left, fresh));
            emit(pass, params, lane_first, fresh, &photon);
            left -= select((Int)(0), (Int)(1), fresh);
            steps = select(steps, (Int)(0), fresh);
            alive |= fresh;
        }
        if (!any_lane(alive)) break;

        Int cell = (photon.z * ny + photon.y) * nx + photon.x;
        Real sigma = gather_reals(extinction_per_mm, select((Int)(0), cell, alive));
        Real tx = wall(photon.p.x, photon.d.x, photon.x), ty = wall(photon.p.y, photon.d.y, photon.y), tz = wall(photon.p.z, photon.d.z, photon.z);
        Real t_wall = fmin(tx, fmin(ty, tz));
        Mask hit = MASK(photon.depth < sigma * t_wall) & alive;
        Real t = select(t_wall, photon.depth / sigma, hit);
        photon.p = select3(photon.p, along(photon.p, photon.d, t), alive);
        path += select((Real)(0.0f), t, alive);
        if (params->tally == TALLY_FLUENCE_TRACK) tally(grid, cell, photon.weight * t * params->cells_per_mm[0], alive);

        Mask crosses = alive & ~hit;
        photon.depth = select(photon.depth, fmax(photon.depth - sigma * t_wall, (Real)(0.0f)), crosses);
        Mask in_x = crosses & MASK(tx == t_wall), in_y = crosses & ~in_x & MASK(ty == t_wall), in_z = crosses & ~in_x & ~in_y;
        Int up_x = select((Int)(-1), (Int)(1), MASK(photon.d.x > 0.0f)), up_y = select((Int)(-1), (Int)(1), MASK(photon.d.y > 0.0f)), up_z = select((Int)(-1), (Int)(1), MASK(photon.d.z > 0.0f));
        photon.x += in_x & up_x, photon.y += in_y & up_y, photon.z += in_z & up_z;
        Mask out_x = in_x & (MASK(photon.x < 0) | MASK(photon.x >= nx)), out_y = in_y & (MASK(photon.y < 0) | MASK(photon.y >= ny)), out_z = in_z & (MASK(photon.z < 0) | MASK(photon.z >= nz));
        Mask out = out_x | out_y | out_z;
        if (any_lane(out)) {
            Int face = select(select((Int)(4), (Int)(2), out_y), (Int)(0), out_x);
            Int up = select(select(up_z, up_y, out_y), up_x, out_x);
            tally(ledger, LEDGER_EXIT + face + select((Int)(0), (Int)(1), MASK(up > 0)), photon.weight, out);
        }
        Mask goes_on = hit;
        if (any_lane(hit)) {
            goes_on = collide(pass, params, lane_first, sigma, cell, hit, grid, ledger, &photon);
            scatterings += as_UInt(select((Int)(0), (Int)(1), hit));
        }
        steps += 1;
        Mask fault = alive & (MASK(steps > MOST_STEPS) | MASK(!(photon.weight <= 1e30f)));
        if (any_lane(fault)) {
            tally(ledger, (Int)(LEDGER_LOST), select((Real)(0.0f), photon.weight, MASK(photon.weight <= 1e30f)), fault & ~out & (goes_on | crosses));
            tally(ledger, (Int)(LEDGER_FAULTS), (Real)(1.0f), fault);
        }
        alive = ((crosses & ~out) | goes_on) & ~fault;
    }
    tally(ledger, (Int)(LEDGER_SCATTERINGS), to_real(scatterings), (Mask)(-1));
    tally(ledger, (Int)(LEDGER_PATH), path, (Mask)(-1));
}
