// view_internal.h: private to room view.
#ifndef OM_VIEW_INTERNAL_H
#define OM_VIEW_INTERNAL_H

#include "omentum/view.h"

enum {
    VIEW_SCENE = 1,
    VIEW_FRAME,
    VIEW_POINTS,
    VIEW_DIFFERENCES,
    VIEW_CHANCES
};                                                                    // kinds of messages
enum { VIEW_HAS_STRESS = 1, VIEW_HAS_CONTACT = 2, VIEW_NFIELD = 2 };  // fields of a part in a frame
enum {
    VIEW_MAX_PART = 4 + OM_MAX_ARM,
    VIEW_FRAME_HEAD = 44,  // bytes of a frame before its first part
    VIEW_BOX = 24          // of the box of a part
};

typedef struct ViewAsset {  // a file of the page
    const char* data;
    size_t size;
} ViewAsset;

typedef enum ViewAssetName { VIEW_HTML, VIEW_CSS, VIEW_JS, VIEW_THREE, VIEW_NASSET } ViewAssetName;

// view_assets.c: the files in page/, which are part of the library.
ViewAsset om__view_asset(ViewAssetName name);
// view_page.c: the page of a server, whose scripts are files beside it. `html` is appended to.
OmStatus om__view_live_page(const char* title, OmText* html);
// Frames become those of differences, in place. @return OM_OK; OM_INVALID (a message that is not whole); OM_NO_MEMORY
OmStatus om__view_subtract(char* bytes, size_t size);

#endif
