// view_assets.c: the files of the page, inside of the library.
//
// The assembler includes them: an array of 570,000 bytes in C takes the compiler seconds.
#include "view/view_internal.h"

#define INCLUDE(name, file)                                                                       \
    __asm__(".pushsection .rodata\n"                                                              \
            ".global om__view_" #name "\nom__view_" #name ":\n.incbin \"" OM_PAGE "/" file "\"\n" \
            ".global om__view_" #name "_end\nom__view_" #name "_end:\n.byte 0\n"                  \
            ".popsection\n");                                                                     \
    extern const char om__view_##name[] __attribute__((visibility("hidden")));                    \
    extern const char om__view_##name##_end[] __attribute__((visibility("hidden")));

INCLUDE(html, "page.html")
INCLUDE(css, "page.css")
INCLUDE(js, "page.js")
INCLUDE(three, "three_bundle.js")

ViewAsset om__view_asset(ViewAssetName name) {
    const char* const begin[VIEW_NASSET] = {om__view_html, om__view_css, om__view_js,
                                            om__view_three};
    const char* const end[VIEW_NASSET] = {om__view_html_end, om__view_css_end, om__view_js_end,
                                          om__view_three_end};
    return (ViewAsset){begin[name], (size_t)(end[name] - begin[name])};
}
