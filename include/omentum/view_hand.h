/// omentum/view_hand.h: lines by which a page moves tissue by hand, read (room `view`, floor 5).
///
/// | line                 | what it means                                                              |
/// |----------------------|----------------------------------------------------------------------------|
/// | grasp X Y Z          | hold the tissue at a point, world frame, m                                 |
/// | press X Y Z          | a ball with its centre there presses on the tissue                         |
/// | move X Y Z           | the held tissue, or the ball, follows to this point                        |
/// | release              | let go; the ball is gone                                                   |
/// | pause, go, step      | stop, continue, one time step                                              |
/// | reset                | back to rest, with the scene's modulus                                     |
/// | young FACTOR         | the modulus times this factor, 0.1 to 10                                   |
/// | poisson VALUE        | Poisson's ratio of all tissue, 0 to OM_MAX_POISSON                         |
/// | probe RADIUS         | of the ball, m, OM_HAND_MIN_RADIUS to OM_HAND_MAX_RADIUS                   |
/// | law, element, engine NAME | of the tissue, as in a scene                                          |
///
///     OmHandLine line;
///     if (om_hand_line_parse("grasp 0 0.01 0.005", &line) == OM_OK) ... line.verb, line.at
#ifndef OMENTUM_VIEW_HAND_H
#define OMENTUM_VIEW_HAND_H

#include "omentum/base.h"
#include "omentum/vec.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OM_HAND_REACH 100.0       // m from the world's origin, of points
#define OM_HAND_MIN_RADIUS 0.001  // m
#define OM_HAND_MAX_RADIUS 0.1
#define OM_HAND_NAME 64  // bytes of a name, with its end

typedef enum OmHandVerb {
    OM_HAND_GRASP,
    OM_HAND_PRESS,
    OM_HAND_MOVE,
    OM_HAND_RELEASE,
    OM_HAND_PAUSE,
    OM_HAND_GO,
    OM_HAND_STEP,
    OM_HAND_RESET,
    OM_HAND_YOUNG,
    OM_HAND_POISSON,
    OM_HAND_PROBE,
    OM_HAND_LAW,
    OM_HAND_ELEMENT,
    OM_HAND_ENGINE,
    OM_HAND_NVERB
} OmHandVerb;
OM_API const char* om_hand_verb_text(OmHandVerb verb);  // its word

typedef struct OmHandLine {
    OmHandVerb verb;
    OmVec3 at;                // m, of grasp, press and move
    double value;             // of young, poisson and probe
    char name[OM_HAND_NAME];  // of law, element and engine
} OmHandLine;

/// Read a line. Numbers are as in files, whatever the locale.
/// @return OM_OK; OM_INVALID (no such word, or not what follows it: the message says what does)
OM_API OmStatus om_hand_line_parse(const char* text, OmHandLine* line);

#ifdef __cplusplus
}
#endif
#endif
