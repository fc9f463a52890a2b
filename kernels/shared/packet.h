// The march that all views share. A work-item renders a beam. All rays take their samples on one grid of steps: sample k stands for k h <= t <= (k +
// 1) h and lies at (k + jitter) h, each pixel with a jitter of its own. So one scalar walk along the beam's middle skips empty cells for the whole
// beam, and the picture is the same as without skipping.
#ifndef SHARED_PACKET_H
#define SHARED_PACKET_H

#include "shared/beam.h"
#include "shared/block.h"
#include "shared/camera.h"
#include "shared/inner.h"
#include "shared/lanes.h"
#include "shared/places.h"
#include "shared/rng.h"
#include "shared/shade.h"
#include "shared/volume.h"

// Samples between two checks of the cells and of the packets that go on.
#define STRIDE 8

typedef struct {
    Int column, row;      // in this pass's film
    UInt pixel;           // its number in the full image
    Int sample;           // its number in the pixel
    Mask inside;          // true in the picture
    Real x, y;            // image point in full-size pixels
    Ray ray;              // t_near > t_far if it misses
    Real jitter;
    Real3 start, pace;    // sample k is at start + k pace, as inner_raw takes it
    int inner, inner_end; // steps in which every lane takes its whole sample, away from the box's faces by the margin
#if SHADED
    Real3 half_way[MAX_LIGHTS]; // between the ray and each light
#endif
#ifdef NARROW
    float4 low, low_pace; // no lane's sample k is below low + k low_pace, in voxels from the middle of voxel 0
    int narrow_end;       // in earlier steps the lanes' samples are within NARROW voxels of each other
#endif
} Packet;

typedef struct {
    float origin[3], direction[3]; // middle of the samples of step k: origin + direction (k h), index units
    float half_width[3];           // no sample of any lane is further from it
    float steps[3];                // steps per voxel along the axis
    int begin, end;                // the steps in which any lane has a sample
} Beam;

#ifdef NARROW
// The least of linear functions lies above its chord, the greatest below.
static inline void narrow_range(constant const View *view, Packet *p) {
    float from = (float)p->inner, steps = (float)max(p->inner_end - p->inner, 1), room = steps;
    float low[3], pace[3];
    #define AXIS(i, c)                                                                                                     \
        {                                                                                                                  \
            Real a = p->start.c + p->pace.c * from, b = a + p->pace.c * steps;                                             \
            float low_a = least_lane(a), low_b = least_lane(b), wide_a = greatest_lane(a) - low_a, wide_b = greatest_lane(b) - low_b; \
            float spare = NARROW * INNER_SCALE - wide_a, growth = (wide_b - wide_a) / steps;                              \
            pace[i] = (low_b - low_a) / (steps * INNER_SCALE);                                                            \
            low[i] = low_a / INNER_SCALE - pace[i] * from - 0.01f;                                                        \
            room = spare < 0.0f ? 0.0f : growth * room > spare ? spare / growth : room;                                    \
        }
    AXIS(0, x)
    AXIS(1, y)
    AXIS(2, z)
    #undef AXIS
    p->low = (float4)(low[0], low[1], low[2], 0.0f);
    p->low_pace = (float4)(pace[0], pace[1], pace[2], 0.0f);
    p->narrow_end = min(p->inner + (int)room, p->inner_end);
    if (min(view->dims[0], min(view->dims[1], view->dims[2])) < NARROW_LEAST) p->narrow_end = p->inner;
}
#endif

static inline Packet packet_at(constant const View *view, int2 corner, float margin) {
    Packet p;
    p.column = corner.x + LANE_IDS % TILE_W;
    p.row = corner.y + LANE_IDS / TILE_W;
    p.inside = MASK(p.column < view->width) & MASK(p.row < view->height);
    Spot spot = spot_at(view, p.column, p.row);
    p.pixel = spot.pixel, p.sample = spot.sample, p.x = spot.x, p.y = spot.y;
    UInt4Lanes ctr = {p.pixel, as_UInt(p.sample), (UInt)(0u), (UInt)(view->stream)};
    p.jitter = view->jittered ? unit_open(philox(ctr, view->seed[0], view->seed[1]).a) : (Real)(view->place);
    p.ray = camera_ray(view, p.x, p.y);
    p.start = inner_position(along(p.ray.origin, p.ray.direction, p.jitter * view->step));
    p.pace = inner_way(scale3(p.ray.direction, (Real)(view->step)));
    Ray inner = p.ray;
    clip_box(view, margin, &inner);
    float from = greatest_lane(inner.t_near) / view->step, to = least_lane(inner.t_far) / view->step;
    p.inner = (int)ceil(clamp(from, -1e8f, 1e8f));
    p.inner_end = (int)floor(clamp(to, -1e8f, 1e8f));
#ifdef NARROW
    narrow_range(view, &p);
#endif
    return p;
}

static inline Beam beam_at(constant const View *view, int number, float margin, Packet *packets) {
    Real first = (Real)(1e30f), last = (Real)(-1e30f);
    for (int i = 0; i < PACKETS; i++) {
        packets[i] = packet_at(view, packet_corner(view, number, i), margin);
        Mask hit = MASK(packets[i].ray.t_far > packets[i].ray.t_near);
        first = fmin(first, select((Real)(1e30f), packets[i].ray.t_near, hit));
        last = fmax(last, select((Real)(-1e30f), packets[i].ray.t_far, hit));
    }
    float near = least_lane(first), far = greatest_lane(last);
    Beam b;
    b.begin = b.end = 0;
    if (!(far > near)) return b;
    // Steps are counted in an int. Nobody waits for more.
    b.begin = (int)floor(clamp(near / view->step, -1e9f, 1e9f));
    b.end = (int)ceil(clamp(far / view->step, -1e9f, 1e9f));
    RealLanes v;
    Real farthest;
    #define MIDDLE(to, first, last) v.v = 0.5f * (first + last); to = 0.5f * (v.lane[0] + v.lane[LANES - 1])
    // A sample lies anywhere in its step. The middle of the step stands for it.
    #define AXIS(i, c)                                                                                                     \
        MIDDLE(b.direction[i], packets[0].ray.direction.c, packets[PACKETS - 1].ray.direction.c);                          \
        MIDDLE(b.origin[i], packets[0].ray.origin.c, packets[PACKETS - 1].ray.origin.c);                                   \
        farthest = (Real)(0.0f);                                                                                              \
        for (int j = 0; j < PACKETS; j++) {                                                                                \
            Real o = packets[j].ray.origin.c - b.origin[i], d = packets[j].ray.direction.c - b.direction[i];               \
            farthest = fmax(farthest, fmax(fabs(o + d * (near - view->step)), fabs(o + d * (far + view->step))));                \
        }                                                                                                                  \
        b.half_width[i] = greatest_lane(farthest) + 0.505f * fabs(b.direction[i]) * view->step + 0.01f;                            \
        b.origin[i] += b.direction[i] * 0.5f * view->step;                                                                 \
        b.steps[i] = 1.0f / fmax(fabs(b.direction[i]) * view->step, 1e-12f);
    AXIS(0, x)
    AXIS(1, y)
    AXIS(2, z)
    #undef AXIS
    #undef MIDDLE
    return b;
}

// Three numbers as a vector; the fourth is the third again.
#define FLOATS(v) (float4)((v)[0], (v)[1], (v)[2], (v)[2])

// The number of steps from k on in which no lane's sample is in an occupied cell; 0 if the next one may be.
static inline int beam_leap(constant const View *view, const Beam *b, global const uchar *distances, int k) {
    float at = (float)k * view->step;
    float4 here = FLOATS(b->origin) + FLOATS(b->direction) * at;
    int4 count = ((int4)(view->dims[0], view->dims[1], view->dims[2], 1) + (CELL - 1)) / CELL;
    int4 cell = clamp(convert_int4(here * (1.0f / CELL)), 0, count - 1);
    int distance = distances[(cell.z * count.y + cell.y) * count.x + cell.x];
#if TAPS == 4 || STYLED
    // A cubic reads a voxel beyond the cells' ranges.
    distance -= 1;
#endif
    if (distance <= 0) return 0;
    // The block of empty cells. Beyond the box all is empty too.
    int4 first = cell - distance + 1, last = cell + distance;
    float4 low = select(convert_float4(first * CELL), (float4)(-1e8f), first <= 0);
    float4 high = select(convert_float4(last * CELL), (float4)(1e8f), last >= count);
    float4 back = here - FLOATS(b->half_width) - low, ahead = high - here - FLOATS(b->half_width);
    float4 least = fmin(back, ahead), room = select(back, ahead, FLOATS(b->direction) > 0.0f) * FLOATS(b->steps);
    if (fmin(least.x, fmin(least.y, least.z)) < 0.0f) return 0;
    return (int)fmin(fmin(room.x, 1e8f), fmin(room.y, room.z));
}

// The raw value at the sample of a step that is whole in every lane: inner <= k < inner_end.
static inline __attribute__((always_inline)) Real whole_step_raw(constant const View *view, VOLUME voxels, const Packet *p, int k) {
    Real3 position = along(p->start, p->pace, (Real)((float)k));
    // A block for one step pays off if a register holds it.
#if defined(NARROW) && LANES == 16 && VOXEL == VOXEL_U8
    if (k < p->narrow_end) return narrow_raw(view, voxels, position, p->low + p->low_pace * (float)k) * INNER_UNIT;
#endif
    return inner_raw(view, voxels, position) * INNER_UNIT;
}

// The raw values in units of INNER_UNIT at the samples of the steps from k to end - 1, at most STRIDE, which are whole in every lane: inner <= k, end
// <= inner_end.
static inline void whole_steps_raw(constant const View *view, VOLUME voxels, const Packet *p, int k, int end, Real *raw) {
    int i = 0;
#ifdef NARROW
    if (k < p->narrow_end) {
        BlockOffsets offsets = block_offsets(view, p->low + p->low_pace * (float)k, p->low_pace);
#if INNER_WHOLE
        Fixed3 at = fixed3(along(p->start, p->pace, (Real)((float)k))), pace = fixed3_nearest(p->pace);
        for (; i < min(end, p->narrow_end) - k; i++, at = add_fixed3(at, pace)) {
            Block block = block_at(view, voxels, &offsets, i);
            raw[i] = block_raw(&block, inner_of(at));
        }
#else
        for (; i < min(end, p->narrow_end) - k; i++) {
            Block block = block_at(view, voxels, &offsets, i);
            raw[i] = block_raw(&block, along(p->start, p->pace, (Real)((float)(k + i))));
        }
#endif
    }
#endif
    for (; i < end - k; i++) raw[i] = inner_raw(view, voxels, along(p->start, p->pace, (Real)((float)(k + i))));
}

// The part of step k that is inside the lane's ray: the place of its sample and its length, both in t.
static inline Mask edge_sample(constant const View *view, const Packet *p, int k, Real *t, Real *length) {
    Real from = fmax((Real)((float)k * view->step), p->ray.t_near), to = fmin((Real)((float)(k + 1) * view->step), p->ray.t_far);
    *length = to - from;
    *t = mad(*length, p->jitter, from);
    return MASK(*length > 0.0f);
}

#endif
