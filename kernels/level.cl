// The instruction set that this is compiled for, as a number of `LEVELS` in src/device/level.rs.
#if defined(__AVX512F__) && defined(__AVX512BW__) && defined(__AVX512DQ__) && defined(__AVX512VL__)
#define LEVEL 6
#elif defined(__AVX2__)
#define LEVEL 5
#elif defined(__AVX__)
#define LEVEL 4
#elif defined(__SSE4_2__)
#define LEVEL 3
#elif defined(__SSE4_1__)
#define LEVEL 2
#elif defined(__ARM_NEON)
#define LEVEL 1
#else
#define LEVEL 0
#endif

kernel void level(global int *out) {
    if (get_global_id(0) == 0) out[0] = LEVEL;
}
