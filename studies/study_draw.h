// study_draw.h: judged cases follow from the measured sources, so that no method can be tuned to them.
//
// Judged cases are drawn from the hash of what is measured: the folders src/, studies/, scenes/, asp/ and weights/. The
// ids of these folders are git's, computed from the files, so that a tarball without git has them too:
//
//     for f in src studies scenes asp weights; do echo "$f $(git rev-parse COMMIT:$f)"; done | sha1sum | cut -c1-16
//
// A change of any of these files draws other cases. Cases for development have fixed seeds.
//
//     OmStudyDraw draw;
//     om_study_draw_read("here", 1, root, &draw);       // the first of three draws of the present files
//     OmRng rng = om_rng_init(draw.seed, index);
#ifndef OMENTUM_STUDY_DRAW_H
#define OMENTUM_STUDY_DRAW_H

#include "omentum/base.h"

#define OM_STUDY_NDRAW 3  // draws of a commit that a published figure pools

typedef enum OmStudyDrawKind {
    OM_DRAW_PUBLISHED,    // the seeds of tables that were made before there were draws
    OM_DRAW_DEVELOPMENT,  // fixed seeds, for work on a method
    OM_DRAW_JUDGED
} OmStudyDrawKind;

typedef struct OmStudyDraw {
    OmStudyDrawKind kind;
    uint64_t seed;  // judged: of the generator; else 0
    char hash[20];  // judged: 16 digits; else ""
    int number;     // judged: 1 to OM_STUDY_NDRAW
    // judged: id of the commit with these folders, "+": changed since; "-": no git
    char commit[48];
} OmStudyDraw;

// The root of the sources that this program was built from; an error if it is gone.
OmStatus om_study_draw_root(char* out, size_t size);
// What --seed says: null: published; "development"; "here": the files below `root`; a commit, by git; a hash of 16
// digits.
// OM_INVALID: none of these; OM_IO: no folder, no git, or no such commit.
OmStatus om_study_draw_read(const char* word, int number, const char* root, OmStudyDraw* draw);

// The hash of the five folders below `root`, 16 digits. `newest`: null, or the latest change, s since 1970.
OmStatus om__study_draw_hash(const char* root, char hash[20], double* newest);

// Where draws that were run are written: `file`, or if it is null doc/draws.csv of the checkout `root`.
// OM_INVALID: `root` is no checkout and no file is named.
OmStatus om_study_draw_table(const char* file, const char* root, char* out, size_t size);
// Append a line to the table, with its heading if it is new: "study,part,hash,draw,commit,cases,result". A line that is
// there already is not repeated. Nothing is written of draws that are not judged.
OmStatus om_study_draw_append(const char* table, const OmStudyDraw* draw, const char* study,
                              const char* part, const char* cases, const char* result);

#endif
