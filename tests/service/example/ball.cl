// The lit surface of a ball that fills the box of its subject. One work-item is one beam.

#include "shared/beam.h"
#include "shared/camera.h"
#include "shared/film.h"
#include "shared/lanes.h"
#include "shared/places.h"

// The box is one cell: index units go from 0 to 1. In the ball's own units it has its centre at 0 and its surface at 1.
static inline Real3 in_ball(Real3 index, float middle) {
    return real3(2.0f * (index.x - middle), 2.0f * (index.y - middle), 2.0f * (index.z - middle));
}

kernel void ball(constant View *view, constant Ball *params, global const uchar *table, global float *film, global uint *counts) {
    int number = view->first_beam + (int)get_global_id(0);
    if (number >= beams(view)) return;
    for (int i = 0; i < PACKETS; i++) {
        int2 corner = packet_corner(view, number, i);
        Int column = corner.x + LANE_IDS % TILE_W, row = corner.y + LANE_IDS / TILE_W;
        Spot spot = spot_at(view, column, row);
        Ray ray = camera_ray(view, spot.x, spot.y);
        // The lesser root of |o + t d|² = 1.
        Real3 o = in_ball(ray.origin, 0.5f), d = in_ball(ray.direction, 0.0f);
        Real a = dot3(d, d), b = dot3(o, d), c = dot3(o, o) - 1.0f, discriminant = b * b - a * c;
        Mask hit = MASK(discriminant > 0.0f) & MASK(ray.t_far > ray.t_near);
        Real t = (-b - sqrt(select((Real)(0.0f), discriminant, hit))) / a;
        hit &= MASK(t >= ray.t_near);
        // The normal is the point itself. The light comes from the eye.
        Real lambert = params->albedo * fmax(-dot3(along(o, d, t), ray_world(view, spot.x, spot.y)), (Real)(0.0f));
        Real grey = select((Real)(0.0f), lambert, hit);
        film_packet(view, film, counts, column, row, real3(grey, grey, grey), select((Real)(0.0f), (Real)(1.0f), hit));
    }
}
