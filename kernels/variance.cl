// The variance of a film's clusters of 2 x 2 pixels, summed over those at the same place in the cells of a grid: the grid of a probe is placed by it.
//
// Item: a cluster across, and a row of a cell. The rows of those cells down that a probe has, every `sparse`-th one, come first; then those of the
// other cells. Neighbours read neighbours. Sums are in the order of the rows, so that they are the same for any number of threads.

#include "shared/luminance.h"

#pragma OPENCL FP_CONTRACT OFF

// Of one sample a pixel: the sum of squared deviations of four colours from their mean. Deviations from one of them lose no digits in an even picture.
static inline float of_colours(global const float *film, int at, int width) {
    float first = luminance(vload4(at, film));
    float x = luminance(vload4(at + 1, film)) - first;
    float y = luminance(vload4(at + width, film)) - first;
    float z = luminance(vload4(at + width + 1, film)) - first;
    float mean = 0.25f * (x + y + z);
    return fma(-4.0f * mean, mean, fma(x, x, fma(y, y, z * z)));
}

kernel void variance(constant VariancePass *pass, global const float *film, global float *sums) {
    int across = pass->cells[0] * pass->side, item = (int)get_global_id(0);
    if (across == 0 || item >= 2 * pass->side * across) return;
    int x = item % across, row = item / across;
    int is_other = row >= pass->side;
    global const float *deviations = film + 4 * pass->width * pass->height;
    float sum = 0.0f;
    for (int cell = 0; cell < pass->cells[1]; cell++) {
        if ((cell % pass->sparse != 0) != is_other) continue;
        int at = 2 * ((cell * pass->side + row % pass->side) * pass->width + x);
        global const float *upper = deviations + at, *lower = upper + pass->width;
        float variance = pass->of_colours ? of_colours(film, at, pass->width) : upper[0] + upper[1] + lower[0] + lower[1];
        if (isfinite(variance)) sum += variance;
    }
    sums[item] = sum;
}
