// The type of a voxel: a volume has the same type on the device as in its file.
#ifndef SHARED_VOXEL_H
#define SHARED_VOXEL_H

#if VOXEL == VOXEL_U8
#define VOXEL_BYTES 1
typedef uchar Voxel;
#elif VOXEL == VOXEL_I16
#define VOXEL_BYTES 2
typedef short Voxel;
#elif VOXEL == VOXEL_U16
#define VOXEL_BYTES 2
typedef ushort Voxel;
#else
#define VOXEL_BYTES 4
typedef float Voxel;
#endif

#endif
