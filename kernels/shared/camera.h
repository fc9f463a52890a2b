// Rays of a view. The host gives, in double precision, a plane near the volume. A ray goes through its pixel's point on the plane, which keeps its
// digits however far away the eye is (an eye at 10^6 units would lose them all).
//   point(i, j)  = view->plane + i view->right + j view->down             in index units
//   towards      = the same less the eye (perspective) or constant (orthographic), in index units and in world units
// The parameter t is in world units, 0 on the plane; the eye is at t = -t_eye.
#ifndef SHARED_CAMERA_H
#define SHARED_CAMERA_H

#include "shared/lanes.h"

typedef struct {
    Real3 origin;     // index units
    Real3 direction;  // index units per world unit
    Real t_near, t_far;
} Ray;

static inline Real affine(constant const float *base, constant const float *right, constant const float *down, int axis,
                          Real x, Real y) {
    return mad((Real)(right[axis]), x, mad((Real)(down[axis]), y, (Real)(base[axis])));
}

static inline Real3 affine3(constant const float *base, constant const float *right, constant const float *down, Real x,
                            Real y) {
    return real3(affine(base, right, down, 0, x, y), affine(base, right, down, 1, x, y), affine(base, right, down, 2, x, y));
}

// Clips t to the slab low <= origin + t direction <= high. A component of 0 is moved off it, so that 0 times infinity does not occur.
static inline void clip_slab(Real origin, Real direction, float low, float high, Real *t_near, Real *t_far) {
    Real d = select(direction, copysign((Real)(1e-20f), direction), MASK(fabs(direction) < 1e-20f));
    Real inverse = 1.0f / d;
    Real t0 = (low - origin) * inverse, t1 = (high - origin) * inverse;
    *t_near = fmax(*t_near, fmin(t0, t1));
    *t_far = fmin(*t_far, fmax(t0, t1));
}

// Clips t to the volume's box less `margin` voxels at each side.
static inline void clip_box(constant const View *view, float margin, Ray *ray) {
    clip_slab(ray->origin.x, ray->direction.x, margin, (float)view->dims[0] - margin, &ray->t_near, &ray->t_far);
    clip_slab(ray->origin.y, ray->direction.y, margin, (float)view->dims[1] - margin, &ray->t_near, &ray->t_far);
    clip_slab(ray->origin.z, ray->direction.z, margin, (float)view->dims[2] - margin, &ray->t_near, &ray->t_far);
}

// Clips t to the half-space in which the plane's a x + b y + c z + d, in index units, is not negative.
static inline void clip_plane(constant const float *plane, Ray *ray) {
    Real distance = mad(plane[0], ray->origin.x, mad(plane[1], ray->origin.y, mad(plane[2], ray->origin.z, (Real)(plane[3]))));
    Real speed = mad(plane[0], ray->direction.x, mad(plane[1], ray->direction.y, plane[2] * ray->direction.z));
    Mask along = MASK(fabs(speed) < 1e-20f);
    Real t = -distance / select(speed, (Real)(1.0f), along);
    Mask enters = MASK(speed > 0.0f) & ~along, leaves = MASK(speed < 0.0f) & ~along;
    ray->t_near = select(ray->t_near, fmax(ray->t_near, t), enters);
    ray->t_far = select(ray->t_far, fmin(ray->t_far, t), leaves);
    ray->t_far = select(ray->t_far, (Real)(-1e30f), along & MASK(distance < 0.0f));
}

// The t of the eye on the ray through the image point (x, y).
static inline Real eye_on_ray(constant const View *view, Real x, Real y) {
    if (!view->perspective) return (Real)(-view->t_eye);
    Real3 world = affine3(view->towards_world, view->right_world, view->down_world, x, y);
    return -sqrt(dot3(world, world));
}

// The ray through the image point (x, y) in pixels, clipped to the volume's box and the scene's clipping planes.
static inline Ray camera_ray(constant const View *view, Real x, Real y) {
    Ray ray;
    ray.origin = affine3(view->plane, view->right, view->down, x, y);
    Real px = select((Real)(0.0f), x, (Int)(view->perspective)), py = select((Real)(0.0f), y, (Int)(view->perspective));
    Real3 world = affine3(view->towards_world, view->right_world, view->down_world, px, py);
    Real3 towards = affine3(view->towards, view->right, view->down, px, py);
    ray.direction = scale3(towards, 1.0f / sqrt(dot3(world, world)));
    ray.t_near = eye_on_ray(view, x, y);
    ray.t_far = (Real)(1e30f);
    clip_box(view, 0.0f, &ray);
    for (int i = 0; i < view->planes; i++) clip_plane(view->plane_index + 4 * i, &ray);
    return ray;
}

// The unit vector in the world along the ray through the image point (x, y).
static inline Real3 ray_world(constant const View *view, Real x, Real y) {
    Real px = select((Real)(0.0f), x, (Int)(view->perspective)), py = select((Real)(0.0f), y, (Int)(view->perspective));
    Real3 w = affine3(view->towards_world, view->right_world, view->down_world, px, py);
    return scale3(w, rsqrt(dot3(w, w)));
}

#endif
