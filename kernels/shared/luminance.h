// The luminance of linear colours (Rec. 709 primaries, ITU-R BT.709).
#ifndef SHARED_LUMINANCE_H
#define SHARED_LUMINANCE_H

#include "shared/lanes.h"

static inline float luminance(float4 c) { return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z; }

static inline Real luminances(Real3 c) { return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z; }

#endif
