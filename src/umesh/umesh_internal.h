// umesh_internal.h: functions and types that the files of this room share.
#ifndef OMENTUM_UMESH_INTERNAL_H
#define OMENTUM_UMESH_INTERNAL_H

#include "omentum/umesh.h"

#define OM__UMESH_MAX_POINT (1 << 24)  // of a grid

// ---- umesh_grid.c -----------------------------------------------------------------------------------

// Nodes and elements of the active cells. The caller sets `fixed`, `surface_x` and the hash afterwards.
OmStatus om__umesh_grid_init(const OmGrid* points, OmVec3 up, const unsigned char* active,
                             OmUmeshGrid* grid);
// With `fixed` set: mark the free nodes of boundary faces in `is_surface`.
OmStatus om__umesh_grid_find_surface(OmUmeshGrid* grid);
uint64_t om__umesh_grid_hash(const OmUmeshGrid* grid);

// ---- umesh_organ.c ----------------------------------------------------------------------------------

struct OmUmeshOrgan {
    OmUmeshGrid grid;
    OmSurface surface;
    OmSdf sdf;
    double young, poisson;  // of a patient; 0: not known
    double* area;  // cumulative area of the free triangles, m^2               (surface.ntri)
};

// A random point of the free surface, uniform in area, and the outward normal there.
void om__umesh_pick_point(const OmUmeshOrgan* organ, OmRng* rng, OmVec3* p, OmVec3* normal);

// ---- umesh_sample.c ---------------------------------------------------------------------------------

OmStatus om__umesh_check_def(const OmUmeshDataDef* def);
// Hash of all settings that samples depend on.
uint64_t om__umesh_hash_def(const OmUmeshDataDef* def);

// ---- umesh_shard.c ----------------------------------------------------------------------------------

typedef struct OmUmeshShard {  // samples first .. first + num - 1
    int first, num;
    uint64_t seed, hash;
    OmUmeshSample* sample;  //                                                  (num)
    unsigned char* mask;    //                                          (num x nnode)
    float* u;               //                                      (num x nnode x 3)
} OmUmeshShard;

OmStatus om__umesh_shard_alloc(int nnode, int num, OmUmeshShard* shard);
void om__umesh_shard_done(OmUmeshShard* shard);
OmStatus om__umesh_shard_save(const OmUmeshShard* shard, const OmUmeshGrid* grid,
                              const OmUmeshDataDef* def, const char* path);
// Read a shard and its grid.
OmStatus om__umesh_shard_load(const char* path, OmUmeshGrid* grid, OmUmeshShard* shard);
// Read a shard and its grid from bytes in memory; `name` is for messages.
OmStatus om__umesh_shard_parse(const char* data, size_t size, const char* name, OmUmeshGrid* grid,
                               OmUmeshShard* shard);

// ---- umesh_report.c ---------------------------------------------------------------------------------

OmStatus om__umesh_write_report(const OmUmeshDataDef* def, const OmUmeshSummary* summary,
                                const OmUmeshSample* sample, OmUmeshSolver* solver);

#endif
