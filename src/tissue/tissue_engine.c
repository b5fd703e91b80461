// tissue_engine.c: checks of engines, search by name, and an engine's access to model, state and work.
#include <string.h>

#include "tissue/tissue_internal.h"

// ---- engines ----------------------------------------------------------------------------------------

OmStatus om__engine_check(const OmTissueEngine* e) {
    OM_CHECK(e, OM_INVALID, "tissue: engine is null; see om_tissue_default_def");
    OM_CHECK(e->version == OM_ENGINE_VERSION, OM_INVALID,
             "tissue: engine has version %d of the interface; this library has version %d",
             e->version, OM_ENGINE_VERSION);
    OM_CHECK(e->name && e->name[0], OM_INVALID, "tissue: engine has no name");
    OM_CHECK(e->create && e->destroy, OM_INVALID, "tissue: engine \"%s\" lacks create or destroy",
             e->name);
    OM_CHECK(!e->assemble != !e->step, OM_INVALID,
             "tissue: engine \"%s\" must have either assemble or step", e->name);
    OM_CHECK(!e->assemble || e->add_internal_force, OM_INVALID,
             "tissue: engine \"%s\" has assemble, but no add_internal_force", e->name);
    OM_CHECK(!e->load == !e->unload, OM_INVALID,
             "tissue: engine \"%s\" has one of load and unload; it needs both or none", e->name);
    OM_CHECK(!e->needs_file || e->load, OM_INVALID,
             "tissue: engine \"%s\" needs a file, but it has no load", e->name);
    return OM_OK;
}

unsigned om_engine_capabilities(const OmTissueEngine* e) {
    unsigned can = 0;
    if (e->assemble || e->has_forces) can |= OM_ENGINE_FORCES;
    if (e->assemble) can |= OM_ENGINE_TANGENT;
    if (e->assemble && e->eval_balance) can |= OM_ENGINE_STATICS;
    if (e->step) can |= OM_ENGINE_OBSTACLES;
    if (e->get_measure) can |= OM_ENGINE_STRESS;
    if (e->lump_mass) can |= OM_ENGINE_PARTICLES;
    return can;
}

bool om_engine_uses(const OmTissueEngine* e, const char* number) {
    if (strcmp(number, "density") == 0) return true;
    for (int k = 0; e->number && e->number[k]; ++k)
        if (strcmp(e->number[k], number) == 0) return true;
    return false;
}

double om_engine_get_number(const OmEngineInput* input, const char* name, double missing) {
    for (int k = 0; k < input->nnumber; ++k)
        if (strcmp(input->number[k].name, name) == 0) return input->number[k].value;
    return missing;
}

OmStatus om_engine_set_add(OmEngineSet* set, const OmTissueEngine* engine) {
    OM_TRY(om__engine_check(engine));
    OM_CHECK(set->nengine < OM_MAX_ENGINE, OM_INVALID,
             "engine \"%s\": the set has %d engines already", engine->name, set->nengine);
    for (int k = 0; k < set->nengine; ++k)
        OM_CHECK(strcmp(set->engine[k]->name, engine->name) != 0, OM_INVALID,
                 "engine \"%s\": the set has an engine of this name", engine->name);
    set->engine[set->nengine++] = engine;
    return OM_OK;
}

OmStatus om_engine_set_find(const OmEngineSet* set, const char* name,
                            const OmTissueEngine** engine) {
    const char* known[OM_MAX_ENGINE];
    char list[512] = "";
    *engine = NULL;
    for (int k = 0; k < set->nengine; ++k) {
        if (strcmp(set->engine[k]->name, name) != 0) continue;
        *engine = set->engine[k];
        return OM_OK;
    }
    for (int k = 0; k < set->nengine; ++k) {
        size_t used = strlen(list);
        known[k] = set->engine[k]->name;
        snprintf(list + used, sizeof list - used, "%s%s", k > 0 ? ", " : "", known[k]);
    }
    const char* near = om_nearest_word(name, known, set->nengine);
    return om_error(OM_INVALID, "engine \"%.60s\" is not known%s%s%s; engines: %s", name,
                    near ? "; did you mean \"" : "", near ? near : "", near ? "\"?" : "", list);
}

// ---- a model ----------------------------------------------------------------------------------------

void* om_engine_data(const OmTissueModel* m) { return m->data; }
void om_engine_set_data(OmTissueModel* m, void* data) { m->data = data; }
const void* om_engine_options(const OmTissueModel* m) { return m->options; }
const OmTissueDef* om_engine_def(const OmTissueModel* m) { return &m->def; }
const double* om_engine_volume(const OmTissueModel* m) { return m->volume; }
const OmMaterial* om_engine_material(const OmTissueModel* m, int tet) {
    return &m->def.material[m->def.nmaterial > 0 ? m->mesh.tet_label[tet] : 0];
}

// ---- a state ----------------------------------------------------------------------------------------

double* om_engine_x(OmTissueState* s) { return om__state_array(s, OM__X); }
double* om_engine_v(OmTissueState* s) { return om__state_array(s, OM__V); }
double* om_engine_tool_force(OmTissueState* s) { return om__state_array(s, OM__F_TOOL); }
void* om_engine_state_data(const OmTissueState* s) { return om__state_engine(s); }

bool om_engine_find_goal(const OmTissueState* s, int i, OmVec3* goal) {
    int arm = om__state_held_by(s)[i];
    if (!om__is_prescribed(s, i)) return false;
    *goal = arm < 0 ? om_load3(om__state_array(s, OM__ANCHOR), i)
                    : om_pose_apply(s->arm[arm].goal, om_load3(om__state_array(s, OM__GRIP), i));
    return true;
}

bool om_engine_find_spring(const OmTissueState* s, int i, OmVec3* anchor, double* stiffness) {
    *stiffness = om__state_stiffness(s)[i];
    *anchor = om_load3(om__state_array(s, OM__ANCHOR), i);
    return *stiffness > 0;
}

void om_engine_end_step(OmTissueState* s, double h) {
    for (int a = 0; a < OM_MAX_ARM; ++a) s->arm[a].pose = s->arm[a].goal;
    s->time += h;
}

// ---- a work -----------------------------------------------------------------------------------------

void* om_engine_work_data(const OmTissueWork* w) { return w->data; }
void om_engine_set_work_data(OmTissueWork* w, void* data) { w->data = data; }
OmBsr* om_engine_matrix(OmTissueWork* w) { return &w->A; }
double* om_engine_rhs(OmTissueWork* w) { return w->b; }
void om_engine_save_state(const OmTissueState* s, OmTissueWork* w) {
    memcpy(w->backup, s, om__state_bytes(s));
}
void om_engine_restore_state(OmTissueState* s, const OmTissueWork* w) {
    memcpy((void*)s, w->backup, om__state_bytes(s));
}
