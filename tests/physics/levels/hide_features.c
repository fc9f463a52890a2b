// Takes features of the processor out of what LLVM tells PoCL, which then compiles for a lower level, with that level's lanes: PoCL 3.1
// has no setting for it. To be preloaded (LD_PRELOAD) before LLVM 15; HIDE lists how the hidden names start, such as "avx512,avx2".
#define _GNU_SOURCE
#include <dlfcn.h>
#include <link.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

// llvm::StringMap<bool>: a table of entries, each followed by its name, item_size bytes from its start.
typedef struct { size_t length; bool on; } Entry;
typedef struct { Entry **table; unsigned buckets, items, tombstones, item_size; } Map;
#define TOMBSTONE ((Entry *)-8)

// bool llvm::sys::getHostCPUFeatures(StringMap<bool, MallocAllocator> &)
#define FEATURES _ZN4llvm3sys18getHostCPUFeaturesERNS_9StringMapIbNS_15MallocAllocatorEEE
#define TEXT_(name) #name
#define TEXT(name) TEXT_(name)

// PoCL's driver is loaded out of sight of RTLD_NEXT, and LLVM with it.
static int find_llvm(struct dl_phdr_info *info, size_t size, void *found) {
    (void)size;
    if (!strstr(info->dlpi_name, "libLLVM")) return 0;
    *(void **)found = dlopen(info->dlpi_name, RTLD_LAZY | RTLD_NOLOAD);
    return 1;
}

static bool is_hidden(const char *name, const char *hidden) {
    while (hidden && *hidden) {
        size_t length = strcspn(hidden, ",");
        if (!strncmp(name, hidden, length)) return true;
        hidden += length + (hidden[length] == ',');
    }
    return false;
}

bool FEATURES(Map *map) {
    void *llvm = NULL;
    dl_iterate_phdr(find_llvm, &llvm);
    bool (*real)(Map *) = (bool (*)(Map *))dlsym(llvm, TEXT(FEATURES));
    bool known = real(map);
    for (unsigned i = 0; i < map->buckets; i++) {
        Entry *entry = map->table[i];
        if (!entry || entry == TOMBSTONE) continue;
        if (is_hidden((const char *)entry + map->item_size, getenv("HIDE"))) entry->on = false;
    }
    return known;
}
