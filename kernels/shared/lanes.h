// Lanes: the same kernel text runs on packets of LANES rays or photons (PoCL on a CPU does not vectorise divergent loops, so the packet is written
// out in vector types) and on single ones (LANES 1, the fast form on a GPU).
//   Real, Int, UInt   one float, int, uint per lane
//   Mask              an Int that is -1 (yes) or 0 (no) per lane; made by MASK(a < b), joined by & | ~
//   Real3             three Reals; lane types have no vector form of their own
//   any_lane(mask)    true if any lane says yes
// select(no, yes, mask) is OpenCL's own and means the same for LANES 1 and more.
#ifndef SHARED_LANES_H
#define SHARED_LANES_H

#if LANES == 1
#define LANES_SUFFIX
#define MASK(comparison) (-(comparison))
#elif LANES == 4 || LANES == 8 || LANES == 16
#define LANES_SUFFIX LANES
#define MASK(comparison) (comparison)
#else
#error "LANES is 1, 4, 8 or 16"
#endif

#define JOIN_(a, b) a##b
#define JOIN(a, b) JOIN_(a, b)
#if defined(__clang__) && LANES > 1
// More lanes than the processor's registers have are passed to functions in another way than in a program that is compiled for wider ones. No such
// program is linked with this one.
#pragma clang diagnostic ignored "-Wpsabi"
#endif
typedef JOIN(float, LANES_SUFFIX) Real;
typedef JOIN(int, LANES_SUFFIX) Int;
typedef JOIN(uint, LANES_SUFFIX) UInt;
typedef Int Mask;
typedef struct { Real x, y, z; } Real3;

// PoCL's own mad() is a multiplication and an addition; contracted, it is one instruction where the device has it.
#pragma OPENCL FP_CONTRACT ON
#undef mad
#define mad(a, b, c) ((a) * (b) + (c))

#define to_real(v) JOIN(convert_float, LANES_SUFFIX)(v)
#define to_int(v) JOIN(convert_int, LANES_SUFFIX)(v)
#define to_uint(v) JOIN(convert_uint, LANES_SUFFIX)(v)
#define as_Int(v) JOIN(as_int, LANES_SUFFIX)(v)
#define as_UInt(v) JOIN(as_uint, LANES_SUFFIX)(v)
#define as_Real(v) JOIN(as_float, LANES_SUFFIX)(v)

// A tile of pixels is a packet: neighbours diverge least.
#define TILE_W (LANES == 16 ? 4 : LANES == 8 ? 4 : LANES == 4 ? 2 : 1)
#define TILE_H (LANES / TILE_W)

#if LANES == 1
#define LANE_IDS 0
#elif LANES == 4
#define LANE_IDS ((Int)(0, 1, 2, 3))
#elif LANES == 8
#define LANE_IDS ((Int)(0, 1, 2, 3, 4, 5, 6, 7))
#else
#define LANE_IDS ((Int)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15))
#endif

// PoCL's any() takes a long vector lane by lane. A single instruction instead makes a ray march a quarter faster.
#if LANES == 16 && defined(__AVX512DQ__) && __has_builtin(__builtin_ia32_cvtd2mask512)
static inline int any_lane(Mask m) { return __builtin_ia32_cvtd2mask512(m) != 0; }
#elif LANES == 8 && defined(__AVX2__) && __has_builtin(__builtin_ia32_movmskps256)
static inline int any_lane(Mask m) { return __builtin_ia32_movmskps256(as_float8(m)) != 0; }
#elif LANES == 4 && defined(__SSE__) && __has_builtin(__builtin_ia32_movmskps)
static inline int any_lane(Mask m) { return __builtin_ia32_movmskps(as_float4(m)) != 0; }
#elif LANES == 4
// PoCL 6's any() of four makes LLVM 18 give up on some kernels (pocl issue 1608).
static inline int any_lane(Mask m) { return (m.x | m.y | m.z | m.w) != 0; }
#else
static inline int any_lane(Mask m) { return any(m); }
#endif

// The address of a lane's element for access lane by lane (scatter, atomics).
typedef union { Real v; float lane[LANES]; } RealLanes;
typedef union { Int v; int lane[LANES]; } IntLanes;

// The number of lanes that say yes.
static inline int count_lanes(Mask m) {
#if LANES == 1
    return m != 0;
#elif LANES == 8 && defined(__AVX2__) && __has_builtin(__builtin_ia32_movmskps256)
    return popcount(__builtin_ia32_movmskps256(as_float8(m)));
#elif LANES == 16 && defined(__AVX512DQ__) && __has_builtin(__builtin_ia32_cvtd2mask512)
    return popcount((ushort)__builtin_ia32_cvtd2mask512(m));
#else
    int count = 0;
    IntLanes lanes;
    lanes.v = m;
    for (int i = 0; i < LANES; i++) count -= lanes.lane[i];
    return count;
#endif
}

// ULong: 64 bits per lane, in two vectors of half the lanes each. So no vector is wider than the level's registers: a wider one crosses a function's
// boundary in memory, and compilers do not agree on the way (clang's -Wpsabi).
#if LANES == 1
typedef struct { ulong all; } ULong;
static inline ULong ulong_zero(void) { ULong r = {0}; return r; }
static inline ULong ulong_from(UInt v) { ULong r = {v}; return r; }
static inline ULong ulong_rounded(Real v) { ULong r = {(ulong)(long)rint(v)}; return r; }
static inline ULong add_ulong(ULong a, ULong b) { ULong r = {a.all + b.all}; return r; }
static inline ULong ulong_where(Mask m, ULong v) { ULong r = {v.all & (ulong)(long)m}; return r; }
#else
#if LANES == 16
#define HALF 8
#elif LANES == 8
#define HALF 4
#else
#define HALF 2
#endif
typedef JOIN(ulong, HALF) HalfULong;
#if __has_builtin(__builtin_convertvector)
#define to_half_long(v) __builtin_convertvector(v, JOIN(long, HALF))
#define to_half_ulong(v) __builtin_convertvector(v, JOIN(ulong, HALF))
#else
#define to_half_long(v) JOIN(convert_long, HALF)(v)
#define to_half_ulong(v) JOIN(convert_ulong, HALF)(v)
#endif
#define as_half_ulong(v) JOIN(as_ulong, HALF)(v)
typedef struct { HalfULong low, high; } ULong;
static inline ULong ulong_zero(void) { ULong r = {(HalfULong)(0), (HalfULong)(0)}; return r; }
static inline ULong ulong_from(UInt v) { ULong r = {to_half_ulong(v.lo), to_half_ulong(v.hi)}; return r; }
static inline ULong ulong_rounded(Real v) {
    Real whole = rint(v);
    ULong r = {as_half_ulong(to_half_long(whole.lo)), as_half_ulong(to_half_long(whole.hi))};
    return r;
}
static inline ULong add_ulong(ULong a, ULong b) { ULong r = {a.low + b.low, a.high + b.high}; return r; }
static inline ULong ulong_where(Mask m, ULong v) {
    ULong r = {v.low & as_half_ulong(to_half_long(m.lo)), v.high & as_half_ulong(to_half_long(m.hi))};
    return r;
}
#endif
typedef union { ULong v; ulong lane[LANES]; } ULongLanes;

// The lesser and the greater of two; b if a is NaN.
#define LESSER(a, b) ((a) < (b) ? (a) : (b))
#define GREATER(a, b) ((a) > (b) ? (a) : (b))

#if LANES == 1
static inline float least_lane(Real v) { return v; }
#else
static inline float least_lane(Real v) {
#if LANES == 16
    float8 eight = LESSER(v.lo, v.hi);
    float4 four = LESSER(eight.lo, eight.hi);
#elif LANES == 8
    float4 four = LESSER(v.lo, v.hi);
#else
    float4 four = v;
#endif
    float2 two = LESSER(four.lo, four.hi);
    return LESSER(two.x, two.y);
}
#endif

static inline float greatest_lane(Real v) { return -least_lane(-v); }

// A type for one load from any address, of any alignment: PoCL makes several loads of vload4 and the like.
typedef struct __attribute__((packed)) { int word; } UnalignedInt;
typedef struct __attribute__((packed)) { long word; } UnalignedLong;
typedef struct __attribute__((packed)) { float4 four; } UnalignedFloat4;
typedef struct __attribute__((packed)) { Real lanes; } UnalignedReal;
#define INT_AT(from) ((global const UnalignedInt *)(from))->word
#define LONG_AT(from) ((global const UnalignedLong *)(from))->word
#define FOUR_AT(from) ((global const UnalignedFloat4 *)(from))->four
#define REALS_AT(from) ((global const UnalignedReal *)(from))->lanes

// gather_words(base, byte_offset): for each lane 32 bits from base + byte_offset, unaligned. It is one AVX-512 or AVX2 instruction if clang has it;
// plain loads elsewhere. The buffer is padded by 8 bytes.
#if LANES == 16 && defined(__AVX512F__) && __has_builtin(__builtin_ia32_gathersiv16si)
static inline Int gather_words(global const uchar *base, Int byte_offset) {
    return __builtin_ia32_gathersiv16si((Int)(0), (const void *)(size_t)base, byte_offset, (short)-1, 1);
}
#elif LANES == 8 && defined(__AVX2__) && __has_builtin(__builtin_ia32_gatherd_d256)
static inline Int gather_words(global const uchar *base, Int byte_offset) {
    return __builtin_ia32_gatherd_d256((Int)(0), (const int *)(size_t)base, byte_offset, (Int)(-1), 1);
}
#else
#if LANES == 1
static inline Int gather_words(global const uchar *base, Int byte_offset) {
    uchar4 bytes = vload4(0, base + byte_offset);
    return as_int(bytes);
}
#else
static inline Int gather_words(global const uchar *base, Int byte_offset) {
    IntLanes offset, word;
    offset.v = byte_offset;
    for (int i = 0; i < LANES; i++) word.lane[i] = INT_AT(base + offset.lane[i]);
    return word.v;
}
#endif
#endif

// Two adjacent words per lane, from base + byte_offset: half the loads of two gathers.
static inline void gather_pairs(global const uchar *base, Int byte_offset, Int *first, Int *second) {
#if LANES == 16 && defined(__AVX512F__) && __has_builtin(__builtin_ia32_gathersiv8di)
    long8 low = __builtin_ia32_gathersiv8di((long8)(0), (const void *)(size_t)base, byte_offset.lo, (char)-1, 1);
    long8 high = __builtin_ia32_gathersiv8di((long8)(0), (const void *)(size_t)base, byte_offset.hi, (char)-1, 1);
    *first = (Int)(as_int16(low).even, as_int16(high).even);
    *second = (Int)(as_int16(low).odd, as_int16(high).odd);
#elif LANES == 8 && defined(__AVX2__) && __has_builtin(__builtin_ia32_gatherd_q256)
    // A shuffle takes words of each half of two registers in turn. It puts lanes that come in this order right.
    int4 from_low = byte_offset.s0145, from_high = byte_offset.s2367;
    int8 low = as_int8(__builtin_ia32_gatherd_q256((long4)(0), (const long *)(size_t)base, from_low, (long4)(-1), 1));
    int8 high = as_int8(__builtin_ia32_gatherd_q256((long4)(0), (const long *)(size_t)base, from_high, (long4)(-1), 1));
    *first = __builtin_shufflevector(low, high, 0, 2, 8, 10, 4, 6, 12, 14);
    *second = __builtin_shufflevector(low, high, 1, 3, 9, 11, 5, 7, 13, 15);
#else
    *first = gather_words(base, byte_offset);
    *second = gather_words(base + 4, byte_offset);
#endif
}

static inline Int gather_ints(global const int *base, Int index) {
#if LANES == 1
    return base[index];
#elif LANES == 16 && defined(__AVX512F__) && __has_builtin(__builtin_ia32_gathersiv16si)
    return __builtin_ia32_gathersiv16si((Int)(0), (const void *)(size_t)base, index, (short)-1, 4);
#elif LANES == 8 && defined(__AVX2__) && __has_builtin(__builtin_ia32_gatherd_d256)
    return __builtin_ia32_gatherd_d256((Int)(0), (const int *)(size_t)base, index, (Int)(-1), 4);
#else
    IntLanes from, value;
    from.v = index;
    for (int i = 0; i < LANES; i++) value.lane[i] = base[from.lane[i]];
    return value.v;
#endif
}

static inline Real gather_reals(global const float *base, Int index) {
    return as_Real(gather_ints((global const int *)base, index));
}

static inline Real3 real3(Real x, Real y, Real z) { Real3 r; r.x = x; r.y = y; r.z = z; return r; }
static inline Real3 add3(Real3 a, Real3 b) { return real3(a.x + b.x, a.y + b.y, a.z + b.z); }
static inline Real3 scale3(Real3 a, Real s) { return real3(a.x * s, a.y * s, a.z * s); }
static inline Real3 along(Real3 origin, Real3 direction, Real t) {
    return real3(mad(direction.x, t, origin.x), mad(direction.y, t, origin.y), mad(direction.z, t, origin.z));
}
static inline Real dot3(Real3 a, Real3 b) { return mad(a.x, b.x, mad(a.y, b.y, a.z * b.z)); }
static inline Real3 select3(Real3 no, Real3 yes, Mask m) {
    return real3(select(no.x, yes.x, m), select(no.y, yes.y, m), select(no.z, yes.z, m));
}

// 1 / sqrt(v): an estimate and a Newton step are half the work of the root and the division.
#if LANES == 16 && defined(__AVX512F__) && __has_builtin(__builtin_ia32_rsqrt14ps512_mask)
static inline Real inverse_root(Real v) {
    Real r = __builtin_ia32_rsqrt14ps512_mask(v, (Real)(0.0f), (short)-1);
    return r * mad(-0.5f * v * r, r, (Real)(1.5f));
}
#elif LANES == 8 && defined(__AVX2__) && __has_builtin(__builtin_ia32_rsqrtps256)
static inline Real inverse_root(Real v) {
    // The estimate of this instruction has two bits less, so it takes another step.
    Real r = __builtin_ia32_rsqrtps256(v);
    r *= mad(-0.5f * v * r, r, (Real)(1.5f));
    return r * mad(-0.5f * v * r, r, (Real)(1.5f));
}
#else
static inline Real inverse_root(Real v) { return rsqrt(v); }
#endif

// The reciprocal 1 / v by the same method, to one or two units of the last digit; of 0 it is NaN.
#if LANES == 16 && defined(__AVX512F__) && __has_builtin(__builtin_ia32_rcp14ps512_mask)
static inline Real reciprocal(Real v) {
    Real r = __builtin_ia32_rcp14ps512_mask(v, (Real)(0.0f), (short)-1);
    return mad(mad(-v, r, (Real)(1.0f)), r, r);
}
#else
static inline Real reciprocal(Real v) { return 1.0f / v; }
#endif

// x^y for x in [0, 1] and y >= 1 by squares, from the highest bit of y down; between whole numbers it is interpolated.
static inline Real power(Real x, float y) {
    uint whole = (uint)y;
    float part = y - (float)whole;
    Real result = x;
    for (uint bit = 0x40000000u >> clz(whole); bit > 0u; bit >>= 1) {
        result *= result;
        if (whole & bit) result *= x;
    }
    return part > 0.0f ? result * mad((Real)(part), x - 1.0f, (Real)(1.0f)) : result;
}

#endif
