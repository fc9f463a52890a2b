// The type of a volume's voxels as a kernel's argument: a buffer of bytes, or on a GPU a 3D image, whose sampler interpolates in hardware (its
// weights have 8 fractional bits).
#ifndef SHARED_IMAGE_H
#define SHARED_IMAGE_H

#include "shared/voxel.h"

#if VOLUMES_ARE_IMAGES
#define VOLUME read_only image3d_t
constant const sampler_t linear_sampler = CLK_NORMALIZED_COORDS_FALSE | CLK_ADDRESS_CLAMP_TO_EDGE | CLK_FILTER_LINEAR;
constant const sampler_t point_sampler = CLK_NORMALIZED_COORDS_FALSE | CLK_ADDRESS_CLAMP_TO_EDGE | CLK_FILTER_NEAREST;
// Samplers filter whole numbers as parts of the largest.
#define CHANNEL_SCALE (VOXEL == VOXEL_U8 ? 255.0f : VOXEL == VOXEL_I16 ? 32767.0f : VOXEL == VOXEL_U16 ? 65535.0f : 1.0f)
#else
#define VOLUME global const uchar *
#endif

#endif
