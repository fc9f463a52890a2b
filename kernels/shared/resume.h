// A work-item with more steps than a launch may take leaves its state in memory and goes on in the next launch. So no launch holds the device for
// long, in any scene. `state` begins with RESUME_HEADER words, the first of which counts how often work-items have had more to do. Behind them each
// work-item has a header of as many words, the first of which is 1 while it has more to do, and then some words for each lane, whose number the host
// sets.
#ifndef SHARED_RESUME_H
#define SHARED_RESUME_H

#include "shared/lanes.h"

// The header of a work-item. The state behind it is aligned for lanes.
static inline global uint *resume_header(global uint *state, uint item, uint words) {
    return state + RESUME_HEADER + (size_t)item * (RESUME_HEADER + words * LANES);
}

// The steps that a launch may still take.
static inline uint steps_left(uint most_steps) { return most_steps ? most_steps : 0xffffffffu; }

// Checks that the state fits in the words that the host gives it.
#define STATE_IS(type, words) typedef char state_is_##type[sizeof(type) <= sizeof(Real) * (words) ? 1 : -1]

// Notes that a work-item has more to do.
static inline void has_more(global uint *state, global uint *header) {
    header[0] = 1u;
    atomic_inc(&state[0]);
}

#endif
