/// omentum/tissue_engine.h: the interface that an engine of soft tissue implements (floor 2).
///
/// An *engine* computes how tissue deforms: finite elements, particles, a trained network, or your own. It is a
/// constant table of functions. Callers of tissue.h pass the table to om_tissue_default_def, or a set of tables
/// from which a scene chooses by name (OmEngineSet). There are two kinds:
///
/// - an engine with a tangent fills `assemble`: it writes A and b of A dv = b at the positions of a state. Room
///   tissue does the rest: tools, attachments, contact, the linear solver, Newton's method, cutting of steps.
/// - an engine that moves vertices itself fills `step`: it computes the positions at the end of a step.
///
///     static const OmTissueEngine lattice = {.version = OM_ENGINE_VERSION, .name = "lattice",
///                                            .create = lattice_create, .destroy = lattice_destroy,
///                                            .step = lattice_step, .has_forces = true};
///     OmTissueDef def = om_tissue_default_def(&lattice, &mesh);
///
/// samples/15_write_an_engine.c is a complete one. Functions of an engine read models, states and works by the
/// om_engine_* functions below; these are for engines, not for their callers.
#ifndef OMENTUM_TISSUE_ENGINE_H
#define OMENTUM_TISSUE_ENGINE_H

#include "omentum/tissue.h"

#ifdef __cplusplus
extern "C" {
#endif

// ---- what an engine fills ---------------------------------------------------------------------------

#define OM_ENGINE_VERSION \
    1  // of OmTissueEngine; om_tissue_create refuses tables of another version

/// Factors of the system to assemble: A = mass M + stiffness K + spring k, b = force f(x + lag v) to first order.
typedef struct OmAssembly {
    const double *x, *v;  // (nvert x 3)
    double mass;          // of masses: 1 + h a, 0 in statics
    double stiffness;     // of K: h^2 + h b
    double force;         // of all forces: h
    double lag;           // s, of elastic forces: h + b
    double spring;        // of the springs of attachments: h^2
    double spring_lag;    // s, of their forces: h
    bool is_exact;        // exact tangent; otherwise its negative eigenvalues are set to zero
    bool is_turned;       // use the corotational law with the same constants: a predictor
} OmAssembly;

typedef struct OmTissueCheck {  // outcome of a step for the elements
    int ncrushed;               // flattened or inverted beyond the limit of a step
    int nbarrier;               // crushed elements with a law whose energy is infinite at det F = 0
    int ninverted;              // det F <= 0 at its end
    double elastic_begin;       // J, in floats: off by about 1e-7 of sum V mu
    double elastic_end;
} OmTissueCheck;

typedef struct OmEngineNumber {
    const char* name;  // a key of a scene's tissue without its unit: "cluster_spacing"
    double value;      // SI
} OmEngineNumber;

typedef struct OmEngineInput {  // arguments of `load`, from a scene or a caller
    const char* file;           // path; null: none
    int nnumber;
    const OmEngineNumber* number;  // (nnumber)
} OmEngineInput;
/// The number of this name, or `missing` if the input has none.
OM_API double om_engine_get_number(const OmEngineInput* input, const char* name, double missing);

typedef struct OmTissueEngine {
    int version;          // OM_ENGINE_VERSION
    const char* name;     // in scenes and messages
    const char* summary;  // for reports: "finite elements"; null: the name
    // Names of the scene numbers that have an effect ("young", "poisson", "rayleigh_stiffness", "cluster_spacing"),
    // ended by null; null: density alone. A law has an effect if has_law.
    const char* const* number;
    bool has_law;     // uses the law of OmTissueDef.material
    bool has_forces;  // `step` writes forces in newtons (om_engine_tool_force)
    // attachments may be springs (om_engine_find_spring); false: they are refused
    bool has_springs;
    bool has_quadratic;  // supports OM_ELEMENT_QUADRATIC and OM_ELEMENT_SHELL
    bool needs_file;     // `load` needs a file

    /// Make the engine's options from a file and numbers. The model owns them until it is destroyed. Null: the engine
    /// has no options.
    OmStatus (*load)(const OmEngineInput* input, void** options);
    void (*unload)(void* options);
    /// Make the engine's data of a model (om_engine_set_data), from the checked mesh, definition and options.
    /// `destroy` is called also after a create that failed, and where the model failed before `create`: data is then
    /// null.
    OmStatus (*create)(OmTissueModel* model);
    void (*destroy)(OmTissueModel* model);
    /// Make the engine's data of a work (om_engine_set_work_data); both may be null.
    OmStatus (*create_work)(const OmTissueModel* model, OmTissueWork* work);
    void (*destroy_work)(OmTissueWork* work);
    /// Write A (om_engine_matrix) and b (om_engine_rhs). Null for engines with `step`.
    OmStatus (*assemble)(const OmTissueModel* model, const OmTissueState* state, OmTissueWork* work,
                         const OmAssembly* at);
    /// Compute a whole step with tools and obstacles; report->substeps is set, and each obstacle's force,
    /// torque, ncontact and penetration. With has_forces it writes om_engine_tool_force, the force of the tool
    /// or attachment on each prescribed vertex, and om_tissue_contact_force, the force of obstacles.
    /// The last call is om_engine_end_step. A step that fails leaves the state unchanged.
    OmStatus (*step)(const OmTissueModel* model, OmTissueState* state, OmTissueWork* work, double h,
                     int nobstacle, OmTissueObstacle* obstacle, OmTissueReport* report);
    /// Masses of the vertices, kg (nvert), of a mesh without elements. Null: the engine needs elements.
    OmStatus (*lump_mass)(const OmTissueModel* model, double* mass);
    /// Size of the engine's bytes in a state (om_engine_state_data), and their update after a caller has set positions.
    /// Both may be null.
    size_t (*get_state_size)(const OmTissueModel* model);
    void (*sync_state)(const OmTissueModel* model, OmTissueState* state);

    // Engines with `assemble` need the next function; the others may be null.
    /// Elastic forces at x in double. With a mask only forces on its vertices are computed. They are added
    /// to *sum, and to force (nvert x 3) unless it is null.
    OmStatus (*add_internal_force)(const OmTissueModel* model, const double* x,
                                   const unsigned char* mask, double* force, OmVec3* sum);
    /// A measure of every element (ntet).
    OmStatus (*get_measure)(const OmTissueModel* model, const double* x, OmTissueMeasure measure,
                            double* value);
    OmStatus (*get_energy)(const OmTissueModel* model, const double* x, double* energy);  // J
    /// Forces and energy for Newton's method, computed by all workers: force (nvert x 3) is overwritten.
    OmStatus (*eval_balance)(const OmTissueModel* model, OmTissueWork* work, const double* x,
                             double* force, double* energy);
    /// What a step from x_begin to x_end does to the elements. Null: no step is refused.
    void (*check)(const OmTissueModel* model, const OmTissueWork* work, const double* x_begin,
                  const double* x_end, bool is_solved, OmTissueCheck* check);
    /// Bytes of the engine's data of a model and a work.
    size_t (*get_memory)(const OmTissueModel* model, const OmTissueWork* work);
} OmTissueEngine;

// ---- what an engine can do --------------------------------------------------------------------------

typedef enum OmEngineCapability {  // bits
    OM_ENGINE_FORCES = 1,          // forces of tools and attachments in newtons
    OM_ENGINE_TANGENT = 2,    // a system matrix: the stages of a step, om_press_* of contact_tool.h
    OM_ENGINE_STATICS = 4,    // om_tissue_find_rest
    OM_ENGINE_OBSTACLES = 8,  // om_tissue_step_among
    OM_ENGINE_STRESS = 16,    // om_tissue_get_measure
    OM_ENGINE_PARTICLES = 32  // meshes without elements
} OmEngineCapability;
/// Sum of OmEngineCapability flags, from the functions in the table.
OM_API unsigned om_engine_capabilities(const OmTissueEngine* engine);
/// True if a scene's number of this name has an effect.
OM_API bool om_engine_uses(const OmTissueEngine* engine, const char* number);
/// The engine of a model. Engine pbd may differ from the table in the definition: OmPbdDef.kind selects its table.
OM_API const OmTissueEngine* om_tissue_engine(const OmTissueModel* model);

#define OM_MAX_ENGINE 32
typedef struct OmEngineSet {  // engines to choose from by name; {0} is empty
    int nengine;
    const OmTissueEngine* engine[OM_MAX_ENGINE];  // borrowed, constant tables
} OmEngineSet;
/// @return OM_OK; OM_INVALID (the set is full, has an engine of this name, or the table is incomplete)
OM_API OmStatus om_engine_set_add(OmEngineSet* set, const OmTissueEngine* engine);
/// The engine of that name.
/// @return OM_OK; OM_INVALID (no such engine: the message has the nearest name and all names)
OM_API OmStatus om_engine_set_find(const OmEngineSet* set, const char* name,
                                   const OmTissueEngine** engine);

// ---- a model, for its engine ------------------------------------------------------------------------

// Mesh, masses, gravity and boundary: om_tissue_mesh, om_tissue_mass, om_tissue_gravity, om_tissue_surface_vert.
OM_API void* om_engine_data(const OmTissueModel* model);
OM_API void om_engine_set_data(OmTissueModel* model, void* data);  // in create and destroy only
/// OmTissueDef.options, or the options made by `load`; null: none.
OM_API const void* om_engine_options(const OmTissueModel* model);
/// The checked definition; of its pointers `engine`, `mesh` and `material` alone are kept, the others are null.
OM_API const OmTissueDef* om_engine_def(const OmTissueModel* model);
OM_API const OmMaterial* om_engine_material(const OmTissueModel* model, int tet);
OM_API const double* om_engine_volume(const OmTissueModel* model);  // at rest, m^3 (ntet)

// ---- a state ----------------------------------------------------------------------------------------

OM_API double* om_engine_x(OmTissueState* state);           // m (nvert x 3)
OM_API double* om_engine_v(OmTissueState* state);           // m/s (nvert x 3)
OM_API double* om_engine_tool_force(OmTissueState* state);  // N (nvert x 3)
OM_API void* om_engine_state_data(const OmTissueState* state);
/// True if vertex i is prescribed (by a tool, or by an attachment without a spring). Then *goal is its position at the
/// end of the step.
OM_API bool om_engine_find_goal(const OmTissueState* state, int i, OmVec3* goal);
/// True if a spring attaches vertex i. Then *anchor is the other end of the spring, *stiffness is in N/m.
OM_API bool om_engine_find_spring(const OmTissueState* state, int i, OmVec3* anchor,
                                  double* stiffness);
/// End a step of an engine with `step`: set tools to their goals, advance time by h.
OM_API void om_engine_end_step(OmTissueState* state, double h);

// ---- a work -----------------------------------------------------------------------------------------

OM_API void* om_engine_work_data(const OmTissueWork* work);
OM_API void om_engine_set_work_data(OmTissueWork* work, void* data);
/// A and b, for `assemble`. The pattern of A has a block for each pair of vertices that share an element.
OM_API OmBsr* om_engine_matrix(OmTissueWork* work);
OM_API double* om_engine_rhs(OmTissueWork* work);  // (nvert x 3)
/// Copy the state into the work, and back: for a step that may fail.
OM_API void om_engine_save_state(const OmTissueState* state, OmTissueWork* work);
OM_API void om_engine_restore_state(OmTissueState* state, const OmTissueWork* work);

#ifdef __cplusplus
}
#endif
#endif
