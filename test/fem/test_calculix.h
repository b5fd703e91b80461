// test_calculix.h: CalculiX's reference solutions: meshes, displacements, what is held and moved.
#ifndef OMENTUM_TEST_CALCULIX_H
#define OMENTUM_TEST_CALCULIX_H

#include <zlib.h>

#include "test_files.h"

#include "omentum/shape_file.h"

typedef enum Role { FREE, FIXED, MOVED } Role;

typedef struct CalculixCase {
    const char *mesh, *field;
    Role (*role)(OmVec3 p);
    OmVec3 travel;    // of moved vertices, m
    OmVec3 reaction;  // on them, N
} CalculixCase;

static Role block_role(OmVec3 p) {
    if (p.z < 1e-6) return FIXED;
    return p.z > 0.07 - 1e-6 && fabs(p.x) <= 0.026 + 1e-9 && fabs(p.y) <= 0.008 + 1e-9 ? MOVED
                                                                                       : FREE;
}
static Role slab_role(OmVec3 p) {
    if (p.x < -0.06 + 1e-6) return FIXED;
    return hypot(p.x - 0.055, p.y) < 0.008 ? MOVED : FREE;
}

static const CalculixCase calculix_block = {"block.msh.gz",
                                            "block_svk.csv.gz",
                                            block_role,
                                            {0, 0, -0.008},
                                            {-7.934171e-3, -7.917150e-4, -1.018568}};
static const CalculixCase calculix_slab = {"slab.msh.gz",
                                           "slab_nh.csv.gz",
                                           slab_role,
                                           {0, 0, 0.03},
                                           {3.639337e-2, -3.774214e-4, 1.494865e-2}};

// A gzip file of the reference folder beside the data as text (caller frees). Without a data folder the case is
// skipped.
static inline char* calculix_read(const char* name, size_t* size) {
    char relative[256];
    snprintf(relative, sizeof relative, "../reference/calculix/%s", name);
    gzFile file = gzopen(test_data(relative), "rb");
    assert_non_null(file);
    char* text = calloc(1, 1 << 22);
    int num = gzread(file, text, (1 << 22) - 1);
    gzclose(file);
    assert_true(num > 0);
    *size = (size_t)num;
    return text;
}

// The mesh, in metres; vertices keep their numbers, less one.
static inline void calculix_load_mesh(const CalculixCase* c, OmTetMesh* mesh) {
    size_t size = 0;
    char* text = calculix_read(c->mesh, &size);
    const char* path = temp_path("mesh.msh");
    write_bytes(path, text, size);
    free(text);
    assert_ok(om_tet_mesh_load(path, OM_UNIT_MM, mesh));
    assert_ok(om_path_remove(path));
}

// Displacements in metres, in the order of the nodes (om_free).
static inline double* calculix_load_field(const CalculixCase* c, int nvert) {
    size_t size;
    char* text = calculix_read(c->field, &size);
    double* u = om_calloc(3 * (size_t)nvert, sizeof *u);
    int num = 0;
    for (char* line = strtok(text, "\n"); line; line = strtok(NULL, "\n")) {
        int node;
        double x, y, z;
        if (sscanf(line, "%d,%lf,%lf,%lf", &node, &x, &y, &z) != 4) continue;
        assert_true(node >= 1 && node <= nvert);
        om_store3(u, node - 1, om_vec3(1e-3 * x, 1e-3 * y, 1e-3 * z));
        ++num;
    }
    assert_int_equal(num, nvert);
    free(text);
    return u;
}

#endif
