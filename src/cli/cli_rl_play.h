// cli_rl_play.h: the picture of omentum rl play.
#ifndef OMENTUM_CLI_RL_PLAY_H
#define OMENTUM_CLI_RL_PLAY_H

#include "omentum/rl_drive.h"

typedef struct OmCliPlayPicture {
    const char* name;  // --picture; null: none
    char png[1024];    // the file of the picture
    int size;          // pixels along each side
    double period;     // s between two pictures, at least
    double next;       // s, time of the next picture
} OmCliPlayPicture;

// Check the name, FILE.png or FILE.html, and write the page of FILE.html, which shows FILE.png.
OmStatus om_cli_play_picture_begin(OmCliPlayPicture* picture);
// Draw, if it is time for a picture or `is_now`.
OmStatus om_cli_play_picture_draw(OmCliPlayPicture* picture, OmRlDrive* drive, bool is_now);

#endif
