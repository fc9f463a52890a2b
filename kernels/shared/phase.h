// Phase functions: the distribution of directions after a collision. A medium is eight numbers in the table:
//   extinction per mm, albedo, refractive index, kind, then two or three parameters of the kind
//   PHASE_LOBES      g1, g2, weight of g1: two Henyey-Greenstein lobes (one: weight 1; isotropic: g1 = 0)
//   PHASE_RAYLEIGH   none
//   PHASE_TABLE      the start of its rows in the table, their number: rows (cosine, density, cumulative), linear between them
#ifndef SHARED_PHASE_H
#define SHARED_PHASE_H

#include "shared/lanes.h"


typedef struct { Real extinction, albedo; Int kind; Real a, b, c; } Medium;

// sin and cos of a turn's fraction v in [0, 1]: polynomials in a quarter turn, to 2e-7.
static inline void turn(Real v, Real *sine, Real *cosine) {
    Real quarters = rint(4.0f * v), r = mad((Real)(4.0f), v, -quarters), r2 = r * r;
    Real s = r * mad(r2, mad(r2, mad(r2, (Real)(-4.60216311e-3f), (Real)(7.96802229e-2f)), (Real)(-0.645963478f)), (Real)(1.57079632f));
    Real c = mad(r2, mad(r2, mad(r2, mad(r2, (Real)(9.03629884e-4f), (Real)(-2.08600704e-2f)), (Real)(0.253669204f)), (Real)(-1.23370054f)), (Real)(1.0f));
    Int q = to_int(quarters);
    Mask odd = MASK((q & 1) != 0);
    Real a = select(s, c, odd), b = select(c, s, odd);
    *sine = select(a, -a, MASK((q & 2) != 0));
    *cosine = select(b, -b, MASK(((q + 1) & 2) != 0));
}

// Rotates the direction d (unit length) by the angle of 1 - cosine and 1 + cosine, and about itself by the fraction v of a turn. The
// frame is Duff et al.'s ("Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017).
static inline Real3 rotate_direction(Real3 d, Real one_minus, Real one_plus, Real v) {
    Real sine, cosine;
    turn(v, &sine, &cosine);
    Real away2 = fmax(one_minus * one_plus, (Real)(1e-30f)), away = away2 * inverse_root(away2), along_d = 1.0f - one_minus, u = away * cosine, w = away * sine;
    Real s = copysign((Real)(1.0f), d.z), a = -reciprocal(s + d.z), b = d.x * d.y * a;
    Real3 r = real3(mad(along_d, d.x, mad(u, mad(s * d.x * d.x, a, (Real)(1.0f)), w * b)),
                    mad(along_d, d.y, mad(u, s * b, w * mad(d.y * d.y, a, s))),
                    mad(along_d, d.z, -mad(u, s * d.x, w * d.y)));
    return scale3(r, mad((Real)(-0.5f), dot3(r, r), (Real)(1.5f)));
}

// Inversion of Henyey & Greenstein, Astrophysical Journal 93 (1941): with D = 1 - g + 2 g u,
//   1 - mu = 2 (1 - g)^2 (1 - u) (1 + g u) / D^2,  1 + mu = 2 (1 + g)^2 u (1 - g (1 - u)) / D^2.
// These lose no digits for g = 0, g near 1 or -1, or angles near 0.
static inline void sample_lobe(Real g, Real u, Real *one_minus, Real *one_plus) {
    Real v = 1.0f - u, inverse = reciprocal(mad(2.0f * g, u, 1.0f - g)), twice = 2.0f * inverse * inverse;
    *one_minus = twice * ((1.0f - g) * (1.0f - g)) * (v * mad(g, u, (Real)(1.0f)));
    *one_plus = twice * ((1.0f + g) * (1.0f + g)) * (u * mad(-g, v, (Real)(1.0f)));
}

// The form 1 + g^2 - 2 g mu = (1 - |g|)^2 + 2 |g| (1 -+ mu) loses no digits near the peak.
static inline Real lobe_density(Real g, Real one_minus) {
    Real size = fabs(g), off = select(one_minus, 2.0f - one_minus, MASK(g < 0.0f));
    Real base = fmax(mad(2.0f * size, off, (1.0f - size) * (1.0f - size)), (Real)(1e-20f)), root = sqrt(base);
    return (1.0f - g * g) / (base * root) * 0.0795774715f;
}

// Rayleigh's phase function, p = 3 (1 + mu^2) / (16 pi): mu = A - 1 / A, A^3 = q + sqrt(q^2 + 1), q = 4 u - 2 (Frisvad, JOSA A 28(12), 2011).
static inline Real sample_rayleigh(Real u) {
    Real q = mad((Real)(4.0f), u, (Real)(-2.0f)), size = fabs(q);
    Real a = exp2(log2(size + sqrt(mad(size, size, (Real)(1.0f)))) * 0.333333333f);
    return copysign(clamp(a - 1.0f / a, (Real)(0.0f), (Real)(1.0f)), q);
}

// The last of `rows` whose column (0 cosine, 2 cumulative) is not above x.
static inline Int table_row(global const float *table, Int first, Int rows, int column, Real x) {
    Int low = (Int)(0), high = rows - 1;
    for (int i = 0; i < 10; i++) {
        Int middle = (low + high) >> 1;
        Mask above = MASK(gather_reals(table + column, first + middle * 3) > x);
        Mask narrow = MASK(high - low > 1);
        high = select(high, middle, narrow & above);
        low = select(low, middle, narrow & ~above);
    }
    return low;
}

// Samples a density that is linear between its rows. Its integral is quadratic, so a share x of a row's probability lies at p0 t + (p1 - p0) t^2 / 2
// = x (p0 + p1) / 2.
static inline Real sample_table(global const float *table, Int first, Int rows, Real u) {
    Int at = first + table_row(table, first, rows, 2, u) * 3;
    Real mu = gather_reals(table, at), p0 = gather_reals(table + 1, at), start = gather_reals(table + 2, at);
    Real next = gather_reals(table + 3, at), p1 = gather_reals(table + 4, at), end = gather_reals(table + 5, at);
    Real x = clamp((u - start) / fmax(end - start, (Real)(1e-30f)), (Real)(0.0f), (Real)(1.0f));
    Real mass = x * (p0 + p1), root = sqrt(fmax(mad(p0, p0, (p1 - p0) * mass), (Real)(0.0f)));
    return mad(next - mu, clamp(mass / fmax(p0 + root, (Real)(1e-30f)), (Real)(0.0f), (Real)(1.0f)), mu);
}

static inline Real table_density(global const float *table, Int first, Int rows, Real mu) {
    Int at = first + table_row(table, first, rows, 0, mu) * 3;
    Real low = gather_reals(table, at), p0 = gather_reals(table + 1, at);
    Real high = gather_reals(table + 3, at), p1 = gather_reals(table + 4, at);
    return mad(p1 - p0, (mu - low) / fmax(high - low, (Real)(1e-30f)), p0) * 0.159154943f;
}

// Samples 1 - cosine and 1 + cosine of a collision's angle by the number u.
static inline void sample_phase(global const float *table, const Medium *m, Real u, Real *one_minus, Real *one_plus) {
    Real g = m->a, share = u;
    if (any_lane(MASK(m->c < 1.0f))) {
        Mask first = MASK(u < m->c);
        g = select(m->b, m->a, first);
        share = select((u - m->c) / fmax(1.0f - m->c, (Real)(1e-30f)), u / m->c, first);
    }
    sample_lobe(g, clamp(share, (Real)(5.9604645e-8f), (Real)(0.99999994f)), one_minus, one_plus);
    Mask rayleigh = MASK(m->kind == PHASE_RAYLEIGH), tabulated = MASK(m->kind == PHASE_TABLE);
    if (!any_lane(rayleigh | tabulated)) return;
    Real mu = (Real)(0.0f);
    if (any_lane(rayleigh)) mu = sample_rayleigh(u);
    if (any_lane(tabulated)) {
        Int from = select((Int)(0), to_int(m->a), tabulated), rows = select((Int)(2), to_int(m->b), tabulated);
        mu = select(mu, sample_table(table, from, rows, u), tabulated);
    }
    *one_minus = select(*one_minus, 1.0f - mu, rayleigh | tabulated);
    *one_plus = select(*one_plus, 1.0f + mu, rayleigh | tabulated);
}

// The difference 1 - cosine of two directions: |a - b|^2 / 2, which keeps its digits if they are nearly the same.
static inline Real one_minus_cosine(Real3 a, Real3 b) {
    Real3 off = real3(a.x - b.x, a.y - b.y, a.z - b.z);
    return fmin(0.5f * dot3(off, off), (Real)(2.0f));
}

// The density per steradian of a turn with the given 1 - cosine.
static inline Real phase_density(global const float *table, const Medium *m, Real one_minus) {
    Real mu = 1.0f - one_minus;
    Real density = m->c * lobe_density(m->a, one_minus);
    if (any_lane(MASK(m->c < 1.0f))) density = mad(1.0f - m->c, lobe_density(m->b, one_minus), density);
    Mask rayleigh = MASK(m->kind == PHASE_RAYLEIGH), tabulated = MASK(m->kind == PHASE_TABLE);
    density = select(density, 0.0596831037f * mad(mu, mu, (Real)(1.0f)), rayleigh);
    if (any_lane(tabulated)) {
        Int from = select((Int)(0), to_int(m->a), tabulated), rows = select((Int)(2), to_int(m->b), tabulated);
        density = select(density, table_density(table, from, rows, mu), tabulated);
    }
    return density;
}

#endif
