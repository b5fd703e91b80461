// pbd_internal.h: shared by the files of the room.
#ifndef OMENTUM_PBD_INTERNAL_H
#define OMENTUM_PBD_INTERNAL_H

#include "omentum/pbd.h"
#include "tissue/tissue_internal.h"

#define OM__PBD_LANE 8  // clusters rotated at once
#define OM__PBD_MAP 16  // doubles of a cluster's map: columns of R and t, four each

typedef struct OmPbdClusters {  // region-based shape matching, constant
    int ncluster, nbatch;       // nbatch x OM__PBD_LANE >= ncluster
    int* adr;                   // members of clusters                        (ncluster + 1)
    int* vert;                  //                                            (nmember)
    double* weight;          // w, w q: weight of sum 1, place about the rest centre (nmember x 4)
    double* center;          // rest centres, m                            (ncluster x 3)
    double* spread_inverse;  // pseudo-inverse of sum w q q^T, columns     (ncluster x 9)
    double* flat;            // projection on directions without extent    (ncluster x 9)
    double* part_share;      // 1 / number of its clusters                 (nvert)
    int* part_adr;           // clusters of particles                      (nvert + 1)
    int* part_cluster;       //                                            (nmember)
    double spread2;          // of members about their cluster's centre along the weight, m^2
    double height;           // of stacked clusters along the weight, centre to centre, m
} OmPbdClusters;

typedef struct OmPbdTet {
    int vert[4];
    double grad[9];            // gradients of the shape functions of vertices 1, 2, 3, 1/m
    double gamma;              // volume ratio at which J's constraint is zero
    double volume_compliance;  // 1/J
    double shape_compliance;   // 1/J
    double viscous_rate;       // of its shear, a second of internal friction: 1/s^2
} OmPbdTet;

// elements of one colour, a lane each; unused lanes repeat the last element
typedef struct OmPbdBatch {
    int num;  // used lanes
    int vert[4][OM__PBD_LANE];
    double grad[9][OM__PBD_LANE], gamma[OM__PBD_LANE];
    double volume_compliance[OM__PBD_LANE], shape_compliance[OM__PBD_LANE];
    double viscous_rate[OM__PBD_LANE];
} OmPbdBatch;

typedef struct OmPbdLength {        // of an element of OM_PBD_LENGTHS
    double rest[6], compliance[6];  // of edges, m and m/N
    double volume;                  // m^3
    double volume_compliance;       // m^3/Pa; negative: free
} OmPbdLength;

typedef struct OmPbdElastic {
    int ntet, ncolor;
    int* batch_adr;  // batches of each colour, of OM_PBD_ELASTIC   (ncolor + 1)
    OmPbdBatch* batch;
    int* color_adr;       // elements of each colour                               (ncolor + 1)
    OmPbdTet* tet;        // by colour                                             (ntet)
    OmPbdLength* length;  // of OM_PBD_LENGTHS, else null                     (ntet)
} OmPbdElastic;

typedef struct OmPbd {  // of a model
    OmPbdDef def;
    OmPbdClusters shape;   // of OM_PBD_CLUSTERS, else empty
    OmPbdElastic elastic;  // of the others, else empty
    bool has_pairs;        // particles keep a distance from each other
} OmPbd;

typedef struct OmPbdFrame {  // an obstacle in a substep
    OmPose begin, end;       // pose_world_obstacle
    OmPose inverse_begin, inverse_end;
    double friction;
    bool is_still;  // its frame is the world's
} OmPbdFrame;

enum {                       // role of a particle in a substep, bits
    OM__PBD_PRESCRIBED = 1,  // moved by a tool or fixed
    OM__PBD_SPRING = 2,      // attached to an anchor by a spring
    OM__PBD_NEAR = 4         // near an obstacle
};

#define OM__PBD_NEIGHBOR 16  // largest number of neighbours of a particle

typedef struct OmPbdPairs {  // of self-collision, else empty
    uint32_t mask;           // buckets less one, a power of two less one
    int* adr;                // particles of buckets                                  (buckets + 1)
    int* order;              //                                                       (nvert)
    int* cell;               // of each particle                                      (nvert x 3)
    int* near_num;           //                                                       (nvert)
    int* near;               //                                          (nvert x OM__PBD_NEIGHBOR)
    double* shift;           // of an iteration, m                                    (nvert x 3)
    size_t size;             // bytes of the above
} OmPbdPairs;

typedef struct OmPbdWork {  // of a work
    double* begin;          // positions at the beginning of the substep                (nvert x 3)
    double* map;            // of clusters: columns of R and t, (3.13)   (ncluster x OM__PBD_MAP)
    double* hold;           // reaction of prescribed vertices, N                     (nvert x 3)
    double* v_begin;        // velocities of prescribed vertices at the step's begin     (nvert x 3)
    unsigned char* kind;    //                                                (nvert)
    int* prescribed;  // of each worker's range: those prescribed, -1 behind the last   (nvert)
    double* way;      // of the last iteration, where kind is not 0               (nvert x 3)
    double* pull;     // multipliers of attachment springs in the substep, N s^2   (nvert x 3)
    double* give;     // 1 / mass, 0 where prescribed, 1/kg: of OM_PBD_ELASTIC             (nvert)
    // multipliers of its elements   (ntet x nlambda)
    double* lambda;
    double* normal_sum;    // depth pushed out in the substep, m                        (nvert)
    double* friction_sum;  // slip taken back in the substep, m                         (nvert)
    double* gap_goal;      // gap to be kept in the substep, m              (max_obstacle x nvert)
    // n, c: the obstacle at the predicted position, gap n p + c   (max_obstacle x nvert x 4)
    double* plane;
    unsigned char* is_near;  // worth asking in the substep                   (max_obstacle x nvert)
    double* push;            // by each obstacle, N                       (max_obstacle x nvert x 3)
    OmPbdPairs pairs;
    bool has_pairs[OM_MAX_WORKER];  // found by each member of the team, in the substep
    bool has_contact[OM_MAX_WORKER];
    OmPbdFrame* frame;  //                                                    (max_obstacle)
    int max_obstacle;
    size_t size;  // bytes of the above
} OmPbdWork;

typedef struct OmPbdStep {  // one step, shared by the team
    const OmTissueModel* m;
    const OmPbd* pbd;
    OmTissueState* s;
    OmPbdWork* w;
    double *x, *v;
    double* turn;  // unit quaternions of clusters, in the state         (nbatch x 4 x OM__PBD_LANE)
    int nobstacle;
    OmTissueObstacle* obstacle;
    double h, sub;           // s, of the step and of a substep
    double calm;             // time of internal friction x sub, s^2
    bool is_viscous;         // by the rate of strain, not by its gain in the step
    int nsub, k;             // substeps; the substep
    OmPose arm[OM_MAX_ARM];  // tools at the end of the substep
} OmPbdStep;

// ---- pbd_cluster.c

OmStatus om__pbd_make_clusters(const OmTissueModel* model, const OmPbdDef* def,
                               OmPbdClusters* shape);
void om__pbd_clusters_done(OmPbdClusters* shape);

// ---- pbd_shape.c

/// Centres, rotations and maps of batches [begin, end) at positions x; `turn` continues from its current values.
void om__pbd_match(const OmPbdClusters* shape, double linear_stretch, const double* x, int begin,
                   int end, int nnewton, double* turn, double* map);
/// (3.14) for particles [begin, end): a share `alpha` of the way to the mean of the goals of their clusters is
/// added to x, and put into `way` for those whose kind is not 0: prescribed ones do not move.
void om__pbd_follow(const OmPbdClusters* shape, const double* map, const double* rest, double alpha,
                    const unsigned char* kind, int begin, int end, double* x, double* way);

// ---- pbd_elastic.c

OmStatus om__pbd_make_elastic(const OmTissueModel* model, OmPbdElastic* elastic);
void om__pbd_elastic_done(OmPbdElastic* elastic);
/// Batches [begin, end) of one colour: their multipliers at the substep's beginning; better ones.
void om__pbd_start_elements(const OmPbdStep* s, int begin, int end);
void om__pbd_solve_elements(const OmPbdStep* s, int begin, int end);
/// Internal friction, on velocities.
void om__pbd_calm_elements(const OmPbdStep* s, int begin, int end);
OmStatus om__pbd_add_internal_force(const OmTissueModel* model, const double* x,
                                    const unsigned char* mask, double* force, OmVec3* sum);
OmStatus om__pbd_get_energy(const OmTissueModel* model, const double* x, double* energy);

// ---- pbd_self.c

OmStatus om__pbd_make_pairs(int nvert, OmPbdPairs* pairs);
void om__pbd_pairs_done(OmPbdPairs* pairs);
/// Build the grid of the predicted positions; called by one member of the team.
void om__pbd_fill_grid(OmPbdStep* s);
/// Find the neighbours of particles [begin, end); are there any?
bool om__pbd_find_pairs(OmPbdStep* s, int begin, int end);
/// Corrections of this iteration; then, after all members have computed theirs, apply them.
void om__pbd_find_shifts(OmPbdStep* s, int begin, int end);
void om__pbd_shift(OmPbdStep* s, int begin, int end);

// ---- pbd_length.c

OmStatus om__pbd_make_lengths(const OmTissueModel* model, const OmPbdDef* def,
                              OmPbdElastic* elastic);
/// The same for elements [begin, end) of OM_PBD_LENGTHS.
void om__pbd_solve_lengths(const OmPbdStep* s, int begin, int end);
/// Multipliers of all elements.
static inline size_t om__pbd_nlambda(const OmPbd* pbd) {
    const OmPbdElastic* el = &pbd->elastic;
    if (pbd->def.kind == OM_PBD_LENGTHS) return 7 * (size_t)el->ntet;
    return el->batch_adr ? 2 * OM__PBD_LANE * (size_t)el->batch_adr[el->ncolor] : 0;
}

// ---- pbd_contact.c

OmStatus om__pbd_reserve(OmPbdWork* work, int nvert, int nobstacle);
/// Update the obstacles at substep s->k; called by one member of the team.
void om__pbd_move_obstacles(OmPbdStep* s);
/// Select the obstacles near particle i, predicted at x, in this substep; is there one?
bool om__pbd_find_near(OmPbdStep* s, int i);
/// Move particles out of obstacles, with friction; planes replace the obstacles except in the last iteration.
void om__pbd_push_out(OmPbdStep* s, int i, bool is_last);
/// Resultants of the step.
void om__pbd_report_contacts(OmPbdStep* s);

// ---- pbd_step.c

OmStatus om__pbd_step(const OmTissueModel* model, OmTissueState* state, OmTissueWork* work,
                      double h, int nobstacle, OmTissueObstacle* obstacle, OmTissueReport* report);

#endif
