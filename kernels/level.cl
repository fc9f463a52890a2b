// The instruction set for which this is compiled, as a number of src/device/level.rs.
#if defined(__AVX512F__) && defined(__AVX512BW__) && defined(__AVX512DQ__) && defined(__AVX512VL__)
#define LEVEL LEVEL_AVX512
#elif defined(__AVX2__)
#define LEVEL LEVEL_AVX2
#elif defined(__AVX__)
#define LEVEL LEVEL_AVX
#elif defined(__SSE4_2__)
#define LEVEL LEVEL_SSE42
#elif defined(__SSE4_1__)
#define LEVEL LEVEL_SSE41
#elif defined(__ARM_NEON)
#define LEVEL LEVEL_NEON
#else
#define LEVEL LEVEL_GENERIC
#endif

kernel void level(global int *out) {
    if (get_global_id(0) == 0) out[0] = LEVEL;
}
