// base_blas.c: the only owner of OpenBLAS's number of threads.
//
// OpenBLAS 0.3.21 (Debian 12, pthreads) has one number for the whole process. openblas_set_num_threads() writes it,
// each product reads it when it begins, and neither is guarded: a number that another thread writes meanwhile is used.
// There is no number per thread before 0.3.27 (openblas_set_num_threads_local). The bytes of a product may depend on
// the number. So a scope that needs another number than the open ones waits until they have ended: each product has
// the number that its caller wants, whatever other threads do. Scopes begin in the order in which they were requested,
// so none waits for ever. After the last one the number from before the first is restored.
//
// Rejected: the smallest number of all open scopes (the bytes of a long factorisation would depend on what runs beside
// it); a number that is set and never restored (a program that uses the library finds its own products slower).
#include "base/base_blas.h"

#include <pthread.h>

void openblas_set_num_threads(int n);  // OpenBLAS's own, in no header of the standard interface
int openblas_get_num_threads(void);

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static pthread_cond_t has_changed = PTHREAD_COND_INITIALIZER;
static unsigned next_ticket, serving;  // scopes begin in this order
static int nopen, number, before;  // scopes, their number of threads, the number without any scope
static _Thread_local int depth;    // scopes of this thread

void om__blas_begin(int nthread) {
    if (depth++ > 0) return;
    pthread_mutex_lock(&lock);
    const unsigned ticket = next_ticket++;
    while (ticket != serving || (nopen > 0 && number != nthread))
        pthread_cond_wait(&has_changed, &lock);
    ++serving;
    if (nopen++ == 0) {
        before = openblas_get_num_threads();
        number = nthread;
        if (before != nthread) openblas_set_num_threads(nthread);
    }
    pthread_cond_broadcast(&has_changed);
    pthread_mutex_unlock(&lock);
}

void om__blas_end(void) {
    if (--depth > 0) return;
    pthread_mutex_lock(&lock);
    if (--nopen == 0 && before != number) openblas_set_num_threads(before);
    pthread_cond_broadcast(&has_changed);
    pthread_mutex_unlock(&lock);
}

int om__blas_threads(void) { return openblas_get_num_threads(); }
