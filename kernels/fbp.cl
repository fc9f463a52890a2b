// Filtered backprojection: the host has filtered the rows.

#include "shared/backproject.h"

kernel void fbp(constant BackprojectionPass *pass, global const BackprojectionView *views, global const float *rows, global float *grid) {
    backproject(pass, views, rows, grid);
}
