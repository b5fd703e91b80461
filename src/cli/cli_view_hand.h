// cli_view_hand.h: a hand in the simulation, private to cli_view_free.c and cli_view_hand.c.
#ifndef OM_CLI_VIEW_HAND_H
#define OM_CLI_VIEW_HAND_H

#include "cli_view.h"
#include "omentum/contact_tool.h"
#include "omentum/view.h"

typedef struct Hand {
    const OmCliRetract* s;
    OmScene scene;  // as the page has changed it
    OmViewServer* server;
    OmSite site;
    OmBody* body;
    OmView3d* view;
    OmText message;
    void* start;  // snapshot at rest
    OmVec3 tip, goal;
    bool is_holding, is_pressing, is_paused, has_step, has_forces;
    double time, young;        // s; times the scene's modulus
    double radius;             // m, of the probe
    double thickness;          // m, of the tissue under the ball when it was placed
    OmSurface ball;            // of radius 1
    OmSurface drawn;           // of the probe where it is; in one place: not there
    OmProbe* probe;            // made when it is needed, as `press`
    OmPress* press;            //
    double step_time;          // s, mean of the last steps on the wall
    int nstep;                 // since `counted`
    double counted;            // s: when the rate was sent
    const char* path;          // of the scene
    const char* held;          // how a bare mesh is held, for people; null: as the scene says
    double modified, checked;  // s: when its file was written, and when this was looked at
} Hand;

// Make the scene's tissue, let it settle, and send it.
OmStatus om__hand_begin(Hand* h, const OmProgress* progress);
void om__hand_done(Hand* h);
// A line of the page. What a person got wrong is answered there.
OmStatus om__hand_obey(Hand* h, const char* line);
OmStatus om__hand_step(Hand* h);
OmStatus om__hand_send_frame(Hand* h);
// Steps a second, twice a second.
OmStatus om__hand_send_rate(Hand* h);
// What the tissue is made of, as an answer on the page.
OmStatus om__hand_say_material(Hand* h);

#endif
