/// omentum/study.h: the thesis's experiments as reproducible commands (floor 7).
///
/// The contact study (thesis 3.3, 3.4, 3.7): an ultrasound probe is pressed over each lesion of a breast
/// phantom; three ways to model the contact, on nine meshes, say where the lesion goes. Truth is a finer,
/// quadratic, heterogeneous static model plus the noise of the thesis's tracking. Every run is one file
/// that appears whole or not at all: a study that was killed goes on where it was.
///
///     OmStudyBody* body;
///     om_study_create_phantom(10, 1, &body);
///     OmStudyContactDef def = om_study_default_contact_def(body, "out/contact");
///     om_study_run_contact(&def, progress, &summary);      // out/contact/report.html
///     om_study_destroy_body(body);
#ifndef OMENTUM_STUDY_H
#define OMENTUM_STUDY_H

#include "omentum/shape.h"
#include "omentum/vec.h"

#ifdef __cplusplus
extern "C" {
#endif

// ---- bodies with lesions --------------------------------------------------------------------------

#define OM_STUDY_MAX_LESION 100

typedef struct OmStudyLesion {
    OmVec3 center;  // at rest, m
    double radius;  // m
    OmVec3 touch;   // middle of the probe's face when it first touches, m
    OmVec3 normal;  // unit, out of the body; the probe is pressed along -normal
    OmVec3 along;   // unit, the long side of the probe; perpendicular to normal
} OmStudyLesion;

/// A solid known as a function, its lesions and where it is held: meshed at any resolution.
typedef struct OmStudyBody OmStudyBody;

/// Half an ellipsoid on its flat base z = 0, 150 x 120 mm wide and 72 mm high, the size of a breast
/// biopsy phantom; lesions of 5-10 mm between 10 and 35 mm under the surface, the probe along the normal.
/// @param nlesion  1 to 20
OM_API OmStatus om_study_create_phantom(int nlesion, uint64_t seed, OmStudyBody** body);
/// The solid bounded by a tetrahedral mesh. It is held where the set "attachment" of the mesh is, else at
/// the end of the body towards -`up`.
/// @param up      towards the probe, any length; zero: +z
/// @param unit    length of one unit of both files, m
/// @param lesion  text, one a line: x y z [radius], in file units; "#" begins a comment. Radius 3 mm if
///                it is not given. Lesions outside the body are OM_INVALID
OM_API OmStatus om_study_load_body(const char* mesh, const char* lesion, double unit, OmVec3 up,
                                   OmStudyBody** body);
OM_API void om_study_destroy_body(OmStudyBody* body);
OM_API const OmStudyLesion* om_study_lesions(const OmStudyBody* body, int* nlesion);
/// Negative inside; about a distance near the surface, m.
OM_API double om_study_eval_body(const OmStudyBody* body, OmVec3 p);
/// A mesh of about `ntet` elements, with the set "attachment".
/// @param ntet  100 to 2,000,000
OM_API OmStatus om_study_mesh_body(const OmStudyBody* body, int ntet, int nworker, OmTetMesh* mesh);

#ifdef __cplusplus
}
#endif
#endif
