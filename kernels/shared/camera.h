// Rays of a view. The host gives, in double precision, a plane near the volume: a ray goes through the plane's point of
// its pixel, which keeps its digits however far away the eye is (an eye at 10^6 units would lose them all).
//   point(i, j)  = view->plane + i view->right + j view->down             in index units
//   towards      = the same less the eye (perspective) or constant (orthographic), in index units and in world units
// The parameter t is in world units, 0 on the plane; the eye is at t = -t_eye.

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

// Clips t to the slab 0 <= origin + t direction <= n. A component of 0 is moved off it, so that 0 times infinity does not occur.
static inline void clip_slab(Ray *ray, Real origin, Real direction, float n) {
    Real d = select(direction, copysign((Real)(1e-20f), direction), MASK(fabs(direction) < 1e-20f));
    Real inverse = 1.0f / d;
    Real t0 = -origin * inverse, t1 = (n - origin) * inverse;
    ray->t_near = fmax(ray->t_near, fmin(t0, t1));
    ray->t_far = fmin(ray->t_far, fmax(t0, t1));
}

// The ray through the image point (x, y) in pixels, clipped to the volume's box.
static inline Ray camera_ray(constant const View *view, Real x, Real y) {
    Ray ray;
    ray.origin = affine3(view->plane, view->right, view->down, x, y);
    Real px = select((Real)(0.0f), x, (Int)(view->perspective)), py = select((Real)(0.0f), y, (Int)(view->perspective));
    Real3 world = affine3(view->towards_world, view->right_world, view->down_world, px, py);
    Real length = sqrt(dot3(world, world));
    Real3 towards = affine3(view->towards, view->right, view->down, px, py);
    ray.direction = scale3(towards, 1.0f / length);
    ray.t_near = view->perspective ? -length : (Real)(-view->t_eye);
    ray.t_far = (Real)(1e30f);
    clip_slab(&ray, ray.origin.x, ray.direction.x, (float)view->dims[0]);
    clip_slab(&ray, ray.origin.y, ray.direction.y, (float)view->dims[1]);
    clip_slab(&ray, ray.origin.z, ray.direction.z, (float)view->dims[2]);
    return ray;
}
