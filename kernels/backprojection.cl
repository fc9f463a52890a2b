// Plain backprojection.

#include "shared/backproject.h"

kernel void backprojection(constant BackprojectionPass *pass, global const BackprojectionView *views, global const float *rows, global float *grid) {
    backproject(pass, views, rows, grid);
}
