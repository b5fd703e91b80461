// scene_model_marks.h: the views in a patient model's report, their marks of direction and bars of length.
#ifndef OM_SCENE_MODEL_MARKS_H
#define OM_SCENE_MODEL_MARKS_H

#include "omentum/scene_model.h"
#include "omentum/sense.h"

typedef struct OmViewMarks {
    char left[4], right[4], top[4],
        bottom[4];      // letters of R L A P S I at the borders of a picture
    double bar;         // m
    double bar_pixels;  // its length in a plane at `distance` from the camera, across the view
} OmViewMarks;
OmViewMarks om__view_marks(const OmCamera* camera, double distance);
// Draw the marks into an RGB picture.
void om__draw_marks(OmPicture* picture, const OmViewMarks* marks);

enum { OM_MODEL_VIEWS = 4 };
typedef struct OmModelView {
    OmCamera camera;
    double distance;  // from the camera to the centre of the view, m
    unsigned shown;   // bit set of objects
    const char* caption;
} OmModelView;
// The pictures of a model's report. An organ: from the front, from below and from its left, as
// radiologists view it (the patient's right on the left), and cut open. A sheet: along the covered side.
void om__model_views(const OmPatient* patient, OmModelView view[OM_MODEL_VIEWS]);

#endif
