#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdlib.h>
#include <string.h>
typedef struct { size_t length; unsigned char on; } Entry;
typedef struct { Entry **table; unsigned buckets, items, tombstones, item_size; } Map;
#include <link.h>
static int find(struct dl_phdr_info *info, size_t size, void *found) {
    (void)size;
    if (!strstr(info->dlpi_name, "libLLVM")) return 0;
    *(void **)found = dlopen(info->dlpi_name, RTLD_LAZY | RTLD_NOLOAD);
    return 1;
}
#define REAL "_ZN4llvm3sys18getHostCPUFeaturesERNS_9StringMapIbNS_15MallocAllocatorEEE"
int _ZN4llvm3sys18getHostCPUFeaturesERNS_9StringMapIbNS_15MallocAllocatorEEE(Map *map) {
    void *llvm = 0;
    dl_iterate_phdr(find, &llvm);
    int (*real)(Map *) = (int (*)(Map *))dlsym(llvm, REAL);
    int result = real(map);
    const char *hidden = getenv("HIDE");
    for (unsigned i = 0; hidden && i < map->buckets; i++) {
        Entry *entry = map->table[i];
        if (!entry || entry == (Entry *)-8) continue;
        const char *name = (const char *)entry + map->item_size;
        for (const char *at = hidden; *at;) {
            size_t n = strcspn(at, ",");
            if (!strncmp(name, at, n)) entry->on = 0;
            at += n + (at[n] == ',');
        }
    }
    return result;
}
