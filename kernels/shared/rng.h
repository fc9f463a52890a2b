// Counter-based random numbers: Philox4x32-10 (Salmon, Moraes, Dror, Shaw: "Parallel Random Numbers: As Easy as 1, 2, 3", SC'11). A number is a pure
// function of (seed; index, sample, dimension), so a result does not depend on the number of threads, the slices or the load.
#ifndef SHARED_RNG_H
#define SHARED_RNG_H

#include "shared/lanes.h"

typedef struct { UInt a, b, c, d; } UInt4Lanes;

// The upper halves of 64-bit products.
#if LANES == 1
static inline UInt high_product(UInt x, uint m) { return (uint)(((ulong)x * m) >> 32); }
#elif LANES == 16 && defined(__AVX512F__) && __has_builtin(__builtin_convertvector)
// AVX-512 widens and narrows lanes by one instruction; within a function no vector is too wide.
static inline UInt high_product(UInt x, uint m) {
    return __builtin_convertvector((__builtin_convertvector(x, ulong16) * (ulong)m) >> 32, UInt);
}
#else
// Elsewhere pairs of lanes are taken as 64-bit numbers: the product of the even lane of each, then of the odd one (pmuludq).
static inline UInt high_product(UInt x, uint m) {
    HalfULong pairs = as_half_ulong(x), even = (pairs & 0xffffffffUL) * (ulong)m, odd = (pairs >> 32) * (ulong)m;
    return as_UInt((even >> 32) | (odd & 0xffffffff00000000UL));
}
#endif

static inline UInt4Lanes philox_round(UInt4Lanes ctr, uint key0, uint key1) {
    UInt hi0 = high_product(ctr.a, 0xD2511F53u), lo0 = ctr.a * 0xD2511F53u;
    UInt hi1 = high_product(ctr.c, 0xCD9E8D57u), lo1 = ctr.c * 0xCD9E8D57u;
    UInt4Lanes next = {hi1 ^ ctr.b ^ key0, lo1, hi0 ^ ctr.d ^ key1, lo0};
    return next;
}

#define PHILOX_ROUNDS 10
#define PHILOX_KEYS(round) key0 + (round) * 0x9E3779B9u, key1 + (round) * 0xBB67AE85u

// ctr = (index, sample, dimension, stream), key = seed.
static inline UInt4Lanes philox(UInt4Lanes ctr, uint key0, uint key1) {
    for (uint round = 0; round < PHILOX_ROUNDS; round++) ctr = philox_round(ctr, PHILOX_KEYS(round));
    return ctr;
}

// The numbers of two counters, for little more time than one: a round waits for the round before it.
static inline void philox_two(UInt4Lanes *a, UInt4Lanes *b, uint key0, uint key1) {
    for (uint round = 0; round < PHILOX_ROUNDS; round++) {
        *a = philox_round(*a, PHILOX_KEYS(round));
        *b = philox_round(*b, PHILOX_KEYS(round));
    }
}

// A number strictly inside (0, 1): 23 bits and a half, so that neither log(u) nor log(1 - u) is ever infinite.
static inline Real unit_open(UInt bits) { return mad(to_real(bits >> 9), 1.1920928955078125e-7f, 5.9604644775390625e-8f); }

// A free path in optical depth, -ln(u), to 1e-7 of it: u = m 2^e with m from sqrt(1/2) to sqrt(2), and
// ln(1 + f) = f - f^2 / 2 + f^3 Q(f), with Q fitted to its least greatest relative error, 3e-8.
static inline Real free_depth(UInt number) {
    Int bits = as_Int(unit_open(number)), e = (bits - 0x3f3504f3) >> 23;
    Real f = as_Real(bits - (e << 23)) - 1.0f, q = (Real)(0.0870035961f);
    q = mad(q, f, (Real)(-0.142674759f)), q = mad(q, f, (Real)(0.149147868f)), q = mad(q, f, (Real)(-0.165775865f));
    q = mad(q, f, (Real)(0.199630618f)), q = mad(q, f, (Real)(-0.250013381f)), q = mad(q, f, (Real)(0.333339095f));
    return mad(to_real(e), (Real)(-0.693147181f), -mad(f * f, mad(q, f, (Real)(-0.5f)), f));
}

#endif
