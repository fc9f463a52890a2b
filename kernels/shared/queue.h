// The queue of photons that a work-item launches: a lane whose photon has ended takes the next one.
#ifndef SHARED_QUEUE_H
#define SHARED_QUEUE_H

#include "shared/lanes.h"

// The photons that a work-item still has to launch.
typedef struct {
    uint next, end; // the rest of its share
    bool more;      // true while another share may be taken
    long launched, passed; // photons so far, and steps of all lanes
} Queue;

// The end of the share that begins with photon `first`.
static inline uint share_end(constant const FieldPass *pass, uint first) { return first + min(pass->count - first, pass->per_item); }

// A work-item has one share; with a grid of its own it takes one share after the other until there are none.
static inline Queue queue_of(constant const FieldPass *pass, uint item) {
    Queue q;
    q.next = pass->own_grids ? 0 : item * pass->per_item;
    q.end = pass->own_grids ? 0 : share_end(pass, q.next);
    q.more = pass->own_grids;
    q.launched = q.passed = 0;
    return q;
}

static inline void take_share(constant const FieldPass *pass, global ulong *ledger, Queue *q) {
    q->next = min((uint)atom_add(&ledger[pass->taken_at], (ulong)pass->per_item), pass->count);
    q->end = share_end(pass, q->next);
    q->more = q->next < q->end;
}

// True if photons are to be launched into `free` lanes. A launch costs about a step of all lanes. If each launch fills f lanes, and photons live n
// steps, then launches take LANES / (n f) of the time and free lanes lose (f - 1) / (2 LANES). Their sum is least if f^2 is 2 LANES^2 / n. So far n
// is LANES times the steps that have passed over the photons launched.
static inline int is_launch_due(int free, const Queue *q) {
    return free == LANES || free * free * q->passed >= 2 * LANES * q->launched;
}

// Gives each free lane the number of the next photon, in the lanes' order. Returns the lanes that have one.
static inline Mask take_photons(Mask alive, Queue *q, UInt *number) {
    IntLanes free, rank;
    free.v = ~alive;
    int left = (int)(q->end - q->next), given = 0;
    for (int i = 0; i < LANES; i++) rank.lane[i] = given, given -= free.lane[i];
    Mask fresh = ~alive & MASK(rank.v < left);
    *number = as_UInt(rank.v) + q->next;
    given = min(given, left), q->next += (uint)given, q->launched += given;
    return fresh;
}

#endif
