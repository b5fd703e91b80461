// base_blas.h: the number of threads of the BLAS, for as long as a thread needs it.
#ifndef OMENTUM_BASE_BLAS_H
#define OMENTUM_BASE_BLAS_H

/// From here to om__blas_end() of the same thread, products of the BLAS use `nthread` threads. Scopes of one number
/// overlap; a scope of another number waits for the end of those before it. Inside a scope of the same thread the
/// number of the outer one stays. A scope must not wait for a thread that begins one.
void om__blas_begin(int nthread);
/// After the last open scope the BLAS has the number again that it had before the first.
void om__blas_end(void);
/// The number that a product would use now.
int om__blas_threads(void);

#endif
