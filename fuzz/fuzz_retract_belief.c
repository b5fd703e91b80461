// fuzz_retract_belief.c: the reader of what a robot knows of its patient.
//
// Unchanged bytes seldom pass the checksum, behind which HDF5 reads; its library is not ours to fuzz. So the same
// bytes also change values of a good belief before it is written. The reader must refuse the file, or return a site
// from which a body is made or refused.
#include <math.h>

#include "fuzz_common.h"
#include "omentum/body.h"
#include "retract/retract_belief.h"

#define CHANGE 10  // bytes of one change

static OmScene scene;
static OmSite good;

static void make_good(void) {
    scene = om_scene_default();
    scene.tissue.cells = om_vec3(4, 4, 1);
    scene.attach.kind = OM_ATTACH_BOX;
    scene.attach.lo = om_vec3(0.01, -1, -1);
    scene.attach.hi = om_vec3(1, 1, 1);
    scene.roi.is_random = false;
    scene.roi.center = om_vec3(-0.03, 0, 0);
    FUZZ_EXPECT(om_site_build(&scene, OM_SITE_TWIN, NULL, &good) == OM_OK);
}

static void check(OmSite* s) {
    const OmTetMesh* m = &s->mesh;
    for (int i = 0; i < 3 * m->nvert; ++i) FUZZ_EXPECT(isfinite(m->x[i]));
    for (int i = 0; i < 4 * m->ntet; ++i)
        FUZZ_EXPECT(m->tet_vert[i] >= 0 && m->tet_vert[i] < m->nvert);
    for (int k = 0; k < m->nset; ++k)
        for (int i = 0; i < m->set[k].nvert; ++i)
            FUZZ_EXPECT(m->set[k].vert[i] >= 0 && m->set[k].vert[i] < m->nvert);
    FUZZ_EXPECT(isfinite(s->young) && isfinite(s->pose_world_task.q.w));
    OmBody* body;
    OmStatus status = om_body_create(&scene, s, 1, &body);
    FUZZ_EXPECT(status == OM_OK || om_error_message()[0] != '\0');
    if (status < 0) return;
    const double* x = om_body_x(body);
    for (int i = 0; i < 3 * m->nvert; ++i) FUZZ_EXPECT(isfinite(x[i]));
    om_body_destroy(body);
}

static void load(const char* path) {
    OmSite s;
    OmStatus status = om__belief_load(path, &s);
    FUZZ_EXPECT(status <= 0);
    if (status == OM_OK)
        check(&s);
    else
        FUZZ_EXPECT(s.mesh.x == NULL && om_error_message()[0] != '\0');
    om_site_done(&s);
}

// Which value, a place, and its new bits. @return the value's old bits and where they belong
typedef struct Old {
    void* at;
    size_t size;
    char bits[8];
} Old;

static Old change(const uint8_t* c) {
    const size_t place = (size_t)(c[1] | c[2] << 8);
    OmMeshSet* set = &good.mesh.set[place % (size_t)good.mesh.nset];
    Old old = {0};
    switch (c[0] % 9) {
    case 0: old = (Old){&good.mesh.x[place % (3 * (size_t)good.mesh.nvert)], 8, {0}}; break;
    case 1: old = (Old){&good.mesh.tet_vert[place % (4 * (size_t)good.mesh.ntet)], 4, {0}}; break;
    case 2: old = (Old){&good.mesh.tet_label[place % (size_t)good.mesh.ntet], 4, {0}}; break;
    case 3:
        if (set->nvert > 0) old = (Old){&set->vert[place % (size_t)set->nvert], 4, {0}};
        break;
    case 4: old = (Old){&good.young, 8, {0}}; break;
    case 5: old = (Old){&good.poisson, 8, {0}}; break;
    case 6: old = (Old){&good.density, 8, {0}}; break;
    case 7: old = (Old){&good.pose_world_task.q.y, 8, {0}}; break;
    default: old = (Old){&good.gravity.z, 8, {0}};
    }
    if (!old.at) return old;
    memcpy(old.bits, old.at, old.size);
    memcpy(old.at, c + 2, old.size);
    return old;
}

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    enum { MOST = 8 };
    Old old[MOST];
    const size_t num = size / CHANGE < MOST ? size / CHANGE : MOST;
    size_t n = 0;
    if (!good.mesh.x) make_good();
    const char* path = fuzz_file(data, size, ".h5");
    load(path);
    if (fuzz_is_known(data, num, CHANGE)) {
        fuzz_file_done(path);
        return 0;
    }
    for (; n < num; ++n) old[n] = change(data + CHANGE * n);
    // The writer refuses what no program of ours writes, such as a number that is not finite.
    if (om__belief_save(&good, path) == OM_OK) load(path);
    while (n-- > 0)
        if (old[n].at) memcpy(old[n].at, old[n].bits, old[n].size);
    fuzz_file_done(path);
    return 0;
}
