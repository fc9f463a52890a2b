// Flights along the camera's rays: the start of each, and its length in the volume.
#ifndef SHARED_CAMERA_FLIGHT_H
#define SHARED_CAMERA_FLIGHT_H

#include "shared/camera.h"
#include "shared/flight.h"
#include "shared/lanes.h"
#include "shared/rng.h"

typedef struct { Mask meets; Real eye, entry, length; UInt number; } CameraFlight; // t of eye and entry, length, a spare number

// Begins a flight from the eye through a pixel in each lane of `fresh`.
static inline CameraFlight begin_camera_flight(constant const View *view, constant const Scattering *params, float2 offset, Int column, Int row, Mask fresh, Flight *f) {
    Real x = to_real(column * view->stride) + offset.x, y = to_real(row * view->stride) + offset.y;
    Ray ray = camera_ray(view, x, y);
    CameraFlight s;
    s.meets = MASK(ray.t_far > ray.t_near);
    s.eye = eye_on_ray(view, x, y);
    s.entry = select(s.eye, ray.t_near, s.meets);
    s.length = select((Real)(0.0f), ray.t_far - ray.t_near, s.meets);
    f->number = as_UInt(select(as_Int(f->number), row * view->stride * view->full_width + column * view->stride, fresh));
    f->event = as_UInt(select(as_Int(f->event), (Int)(0), fresh));
    UInt4Lanes r = draw(view, f, 1);
    f->event += as_UInt(select((Int)(0), (Int)(1), fresh));
    s.number = r.b;
    Real one = (Real)(1.0f);
    fly_on(along(ray.origin, ray.direction, s.entry), ray_world(view, x, y), real3(one, one, one), free_depth(r.a), fresh, f);
    f->left = select(f->left, (Real)(0.0f), fresh & ~s.meets);
    return s;
}

#endif
