// Encodes the film on the device: as the picture in sRGB bytes, and as the sums for its error. The film stays on the device.
//
// Items, in order: blocks of two rows of the film; if the film has fewer pixels than the picture (WHOLE 0), rows of the picture, which is
// interpolated. A block leaves SUM_LENGTH numbers of its own, which the host sums in double precision. Squares are summed relative to the greatest
// square so far, so that none falls below the least float.

#include "shared/lanes.h"
#include "shared/pixels.h"

// Pixels of a row per work-item: a whole number of packets and of tiles.
#define ACROSS (LANES == 1 ? 32 : 8 * LANES)

// Raises `scale` to the greatest value so far. Returns the factor of the squares so far, which are relative to the square of the old scale.
static inline float rescale(float *scale, Real values) {
    if (!any_lane(MASK(values > *scale))) return 1.0f;
    float before = *scale;
    *scale = greatest_lane(values);
    float ratio = before / *scale;
    return ratio * ratio;
}

// Raises `scale`, and the sums of squares that are relative to it.
static inline void raise(float *scale, Real values, Real *truncated, float *blocks, float *block_squares, float *between) {
    float ratio = rescale(scale, values);
    if (ratio != 1.0f) *truncated *= ratio, *blocks *= ratio, *block_squares *= ratio * ratio, *between *= ratio;
}

static inline float inverse(float scale) { return scale > 0.0f ? 1.0f / scale : 0.0f; }

static inline float sum_lanes(Real v) {
#if LANES == 1
    return v;
#else
    RealLanes lanes;
    lanes.v = v;
    float sum = 0.0f;
    for (int i = 0; i < LANES; i++) sum += lanes.lane[i];
    return sum;
#endif
}

// The mean squared deviation of four pixels from their mean. For two rows of a packet it is the sum over the whole blocks of 2 × 2.
#if LANES == 1
#define FOUR Real
#else
typedef JOIN(float, HALF) HalfReal;
#define FOUR HalfReal
#endif
static inline FOUR of_four(FOUR a, FOUR b, FOUR c, FOUR d) {
    FOUR mean = 0.25f * (a + b + c + d);
    a -= mean, b -= mean, c -= mean, d -= mean;
    return 0.25f * (a * a + b * b + c * c + d * d);
}
#if LANES > 1
// The sum, and in `squares` that of the squares.
static inline float of_blocks(Real upper, Real lower, int inside, float *squares) {
    HalfReal whole = of_four(upper.even, upper.odd, lower.even, lower.odd);
    Real blocks = select((Real)(0.0f), (Real)(whole, (HalfReal)(0.0f)), MASK(LANE_IDS < inside / 2));
    *squares += sum_lanes(blocks * blocks);
    return sum_lanes(blocks);
}
#endif

// The sum over every second pixel of a block's row of the squared difference to the mean of its neighbours: the loss of a picture that is
// interpolated between every second one. `row` has the pixels of a packet. With one lane, `last` keeps the last two pixels, the earlier one first.
static inline float of_between(Real row, float scale, int x, int inside, float *last, float *pixels) {
    float sum = 0.0f;
#if LANES == 1
    if (!(x & 1)) {
        float deviation = scale * (last[1] - 0.5f * (last[0] + row));
        if (x % ACROSS) sum = deviation * deviation, *pixels += 1.0f;
    }
    last[0] = last[1], last[1] = row;
#else
    RealLanes lanes;
    lanes.v = row;
    for (int i = 1; i + 1 < min(LANES, inside); i += 2) {
        float deviation = scale * (lanes.lane[i] - 0.5f * (lanes.lane[i - 1] + lanes.lane[i + 1]));
        sum += deviation * deviation, *pixels += 1.0f;
    }
#endif
    return sum;
}

static inline void of_film(constant Encode *d, global const float *film, global const uint *counts, global const uchar *curve,
                           global uchar *picture, int block, global float *sums) {
    int across = (d->width + ACROSS - 1) / ACROSS;
    int x0 = block % across * ACROSS, y0 = block / across * 2;
    int rows = min(2, d->height - y0), end = min(x0 + ACROSS, d->width);
    global const float *deviations = film + 4 * d->width * d->height;
    float scale = 0.0f, blocks = 0.0f, block_squares = 0.0f, between = 0.0f, pixels = 0.0f, noise_scale = 0.0f;
    Real luminance = (Real)(0.0f), truncated = luminance, noise = luminance, squares = luminance, weighted = luminance;
    int unknown = 0, clipped = 0;
#if WHOLE
    Int empty = picture_bytes(d, curve, real3(luminance, luminance, luminance), luminance, (Mask)(0), &clipped);
    int clipped_empty = d->transparent ? 0 : (d->behind[0] > 1.0f) + (d->behind[1] > 1.0f) + (d->behind[2] > 1.0f);
#endif
    float before[2][2] = {{0.0f, 0.0f}, {0.0f, 0.0f}};
    for (int x = x0; x < end; x += LANES) {
        int inside = end - x;
        Mask lanes = MASK(LANE_IDS < inside);
        Real light[2] = {(Real)(0.0f), (Real)(0.0f)};
        uint samples = d->tile > 0 ? counts[y0 / d->tile * d->tiles_wide + x / d->tile] : (uint)d->count;
        for (int row = 0; row < rows; row++) {
            int pixel = (y0 + row) * d->width + x;
            Real alpha;
            Real3 colour = load_pixels(film, pixel, &alpha);
            // Beside the volume only unknown errors are summed.
            Int lit = as_Int(colour.x) | as_Int(colour.y) | as_Int(colour.z) | as_Int(alpha);
            int is_empty = !any_lane(MASK(lit != 0) & lanes);
#if WHOLE
            store_bytes(d, picture, pixel, inside, is_empty ? empty : picture_bytes(d, curve, colour, alpha, lanes, &clipped));
            clipped += is_empty ? clipped_empty * min(inside, LANES) : 0;
#endif
            if (is_empty && !d->deviations) continue;
            Real l = select((Real)(0.0f), luminances(colour), lanes);
            light[row] = l;
            luminance += l;
            weighted += l * (float)samples;
            raise(&scale, fabs(l), &truncated, &blocks, &block_squares, &between);
            Real through = 1.0f - alpha;
            Real behind = (through > 0.0f ? through : (Real)(0.0f)) * l * inverse(scale);
            truncated += select((Real)(0.0f), behind * behind, MASK(through <= d->ended));
            if (!d->deviations) continue;
            Real m2 = load_reals(deviations, pixel);
            unknown += count_lanes(~known(m2) & lanes);
            if (samples < 2) continue;
            Real squared = select((Real)(0.0f), m2 / ((float)samples * (float)(samples - 1)), known(m2) & lanes);
            float ratio = rescale(&noise_scale, squared);
            if (ratio != 1.0f) squares *= ratio;
            Real part = squared * inverse(noise_scale);
            noise += squared;
            squares += part * part;
        }
#if !WHOLE
        // A film of fewer pixels is interpolated: its loss counts down the columns, too.
        int has_next = rows == 2 && y0 + 2 < d->height;
        Real next = (Real)(0.0f);
        if (has_next) {
            Real alpha;
            next = select(next, luminances(load_pixels(film, (y0 + 2) * d->width + x, &alpha)), lanes);
            raise(&scale, fabs(next), &truncated, &blocks, &block_squares, &between);
        }
#endif
        float one = inverse(scale);
#if !WHOLE
        if (has_next) {
            Real deviation = one * (light[1] - 0.5f * (light[0] + next));
            between += sum_lanes(deviation * deviation), pixels += (float)min(inside, LANES);
        }
#endif
#if LANES == 1
        if (rows == 2 && (x & 1)) {
            float block = of_four(before[0][1] * one, light[0] * one, before[1][1] * one, light[1] * one);
            blocks += block, block_squares += block * block;
        }
#else
        if (rows == 2) blocks += of_blocks(light[0] * one, light[1] * one, inside, &block_squares);
#endif
        for (int row = 0; row < rows; row++) between += of_between(light[row], one, x, inside, before[row], &pixels);
    }
    sums[SUM_LUMINANCE] = sum_lanes(luminance);
    sums[SUM_LUMINANCE_SCALE] = scale;
    sums[SUM_TRUNCATED] = sum_lanes(truncated);
    sums[SUM_BLOCKS] = blocks;
    sums[SUM_BLOCK_SQUARES] = block_squares;
    sums[SUM_BETWEEN] = between;
    sums[SUM_PIXELS_BETWEEN] = pixels;
    sums[SUM_NOISE_SCALE] = noise_scale;
    sums[SUM_NOISE] = sum_lanes(noise);
    sums[SUM_NOISE_SQUARES] = sum_lanes(squares);
    sums[SUM_UNKNOWN] = (float)unknown;
    sums[SUM_CLIPPED] = (float)clipped;
    sums[SUM_WEIGHTED] = sum_lanes(weighted);
}

#if !WHOLE
// The position of a picture's pixel among the film's `n`: between the returned pixel and *high, at *part of the distance.
static inline Int film_position(Int full, int stride, int n, Int *high, Real *part) {
    Real at = to_real(full) / (float)stride;
    at = at < (float)(n - 1) ? at : (Real)((float)(n - 1));
    Int low = min(to_int(at), (Int)(max(n - 2, 0)));
    *high = min(low + 1, (Int)(n - 1));
    *part = at - to_real(low);
    return low;
}

static inline Real between(Real a, Real b, Real part) {
#pragma OPENCL FP_CONTRACT OFF
    Real more = (b - a) * part;
    return a + more;
}

// Makes a row of the picture from a film of fewer pixels. Returns the number of clipped values.
static inline int enlarge(constant Encode *d, global const float *film, global const uchar *curve, global uchar *picture, int y) {
    int clipped = 0;
    Int y1;
    Real fy;
    Int y0 = film_position((Int)(y), d->stride, d->height, &y1, &fy);
    for (int x = 0; x < d->picture_width; x += LANES) {
        Int x1;
        Real fx;
        Int x0 = film_position(x + LANE_IDS, d->stride, d->width, &x1, &fx);
        Real out[4];
        for (int c = 0; c < 4; c++) {
            Real top = between(gather_reals(film, 4 * (y0 * d->width + x0) + c), gather_reals(film, 4 * (y0 * d->width + x1) + c), fx);
            Real low = between(gather_reals(film, 4 * (y1 * d->width + x0) + c), gather_reals(film, 4 * (y1 * d->width + x1) + c), fx);
            out[c] = between(top, low, fy);
        }
        int inside = d->picture_width - x;
        Int bytes = picture_bytes(d, curve, real3(out[0], out[1], out[2]), out[3], MASK(LANE_IDS < inside), &clipped);
        store_bytes(d, picture, y * d->picture_width + x, inside, bytes);
    }
    return clipped;
}
#endif

kernel void encode(constant Encode *settings, global const float *film, global const uint *counts, global const uchar *curve,
                    global uchar *picture, global float *sums) {
    int item = (int)get_global_id(0);
    int blocks = (settings->width + ACROSS - 1) / ACROSS * ((settings->height + 1) / 2);
    if (item < blocks) {
        of_film(settings, film, counts, curve, picture, item, sums + SUM_LENGTH * item);
        return;
    }
#if !WHOLE
    int row = item - blocks;
    if (row < settings->picture_height) sums[SUM_LENGTH * item] = (float)enlarge(settings, film, curve, picture, row);
#endif
}
