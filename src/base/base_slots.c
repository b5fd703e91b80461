// base_slots.c: free slots as flags under a mutex, and a condition for threads that wait.
#include "base/base_slots.h"

#include <pthread.h>

struct OmSlots {
    pthread_mutex_t lock;
    pthread_cond_t is_given;
    int n;
    bool is_taken[];
};

OmStatus om__slots_create(int n, OmSlots** out) {
    OmSlots* s = om_calloc(1, sizeof *s + (size_t)n * sizeof *s->is_taken);
    *out = s;
    if (!s) return OM_NO_MEMORY;
    s->n = n;
    pthread_mutex_init(&s->lock, NULL);
    pthread_cond_init(&s->is_given, NULL);
    return OM_OK;
}

void om__slots_destroy(OmSlots* s) {
    if (!s) return;
    pthread_cond_destroy(&s->is_given);
    pthread_mutex_destroy(&s->lock);
    om_free(s);
}

static int find_free(const OmSlots* s) {
    for (int k = 0; k < s->n; ++k)
        if (!s->is_taken[k]) return k;
    return -1;
}

int om__slots_take(OmSlots* s) {
    int slot;
    pthread_mutex_lock(&s->lock);
    while ((slot = find_free(s)) < 0) pthread_cond_wait(&s->is_given, &s->lock);
    s->is_taken[slot] = true;
    pthread_mutex_unlock(&s->lock);
    return slot;
}

void om__slots_give(OmSlots* s, int slot) {
    pthread_mutex_lock(&s->lock);
    s->is_taken[slot] = false;
    pthread_cond_signal(&s->is_given);
    pthread_mutex_unlock(&s->lock);
}
