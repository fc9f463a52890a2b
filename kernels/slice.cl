// A plane through the volume, or the greatest, least or mean value of a slab around it along its normal, by the exact walk of
// shared/walk.h. One work-item is one beam.

#include "shared/camera.h"
#include "shared/inner.h"
#include "shared/lanes.h"
#include "shared/packet.h"
#include "shared/volume.h"
#include "shared/walk.h"
#include "shared/window.h"

static inline void cut(constant const View *view, constant const Slice *params, VOLUME voxels, global const uchar *table,
                       global float *film, global uint *counts, const Packet *p) {
    constant const float *a = params->plane_index, *n = params->normal_index;
    Ray ray = p->ray;
    Real distance = mad(a[0], ray.origin.x, mad(a[1], ray.origin.y, mad(a[2], ray.origin.z, (Real)(a[3]))));
    Real speed = mad(a[0], ray.direction.x, mad(a[1], ray.direction.y, a[2] * ray.direction.z));
    // The plane's normal and the ray are of unit length in the world. Below this product they are parallel.
    Mask shown = MASK(fabs(speed) > 1e-6f);
    Real t = -distance / select((Real)(1.0f), speed, shown);
    shown &= MASK(t >= ray.t_near) & MASK(t <= ray.t_far);
    t = select((Real)(0.0f), t, shown);
    Real3 at = along(ray.origin, ray.direction, t);
    Real raw;
    if (params->half_thickness > 0.0f) {
        Ray slab = {at, real3((Real)(n[0]), (Real)(n[1]), (Real)(n[2])), (Real)(-params->half_thickness), (Real)(params->half_thickness)};
        clip_box(view, 0.0f, &slab);
        slab.t_far = select(slab.t_near, slab.t_far, shown);
        Walk w = walk(view, voxels, params->sign, params->peaks, at, slab.direction, slab.t_near, slab.t_far);
        shown &= params->peaks ? MASK(w.best > -INFINITY) : MASK(w.length > 0.0f);
        raw = params->peaks ? params->sign * w.best : w.integral / select((Real)(1.0f), w.length, MASK(w.length > 0.0f));
    } else {
        Real3 middle = real3((Real)(0.5f), (Real)(0.5f), (Real)(0.5f));
        raw = sample_raw(view, voxels, select3(middle, at, shown));
    }
    shown &= MASK(raw == raw);
    Real value = select((Real)(0.0f), mad(raw, (Real)(params->slope), (Real)(params->inter)), shown);
    film_value(view, film, counts, p, table, params->window_scale, params->window_offset, params->raw_values, value, shown);
}

kernel void slice(constant View *view, constant Slice *params, VOLUME voxels, global const uchar *distances, global const uchar *table,
                  global float *film, global uint *counts) {
    int number = view->first_beam + (int)get_global_id(0);
    if (number >= beams(view)) return;
    Packet packets[PACKETS];
    beam_at(view, number, INNER_MARGIN, packets);
    for (int i = 0; i < PACKETS; i++) cut(view, params, voxels, table, film, counts, &packets[i]);
}
