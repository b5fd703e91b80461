// cli_rl_play_picture.c: the picture of omentum rl play: a PNG file that is replaced again and again, and a page that
// shows it in a browser.
#include "cli_rl_play.h"

#include <string.h>

#include "cli_common.h"

#define MARK "omentum rl play"
#define SHARE 3  // pictures take at most one part of this many of the time

// Letters of a name as a part of an address.
static OmStatus append_address(OmText* text, const char* name) {
    static const char plain[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-";
    OmStatus status = OM_OK;
    for (const char* p = name; *p && status >= 0; ++p)
        status = strchr(plain, *p) ? om_text_append(text, "%c", *p)
                                   : om_text_append(text, "%%%02X", (unsigned)(unsigned char)*p);
    return status;
}

static OmStatus write_page(const char* path, const char* png) {
    const char* slash = strrchr(png, '/');
    OmText text = {0};
    OmStatus status = om_file_check_ours(path, MARK);
    if (status >= 0)
        status = om_text_append(
            &text,
            "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>" MARK "</title>\n"
            "<style>body{margin:0;background:#111}img{display:block;margin:auto;max-width:100vw;"
            "max-height:100vh;width:90vmin}</style>\n<img id=\"p\" alt=\"the environment\" src=\"");
    if (status >= 0) status = append_address(&text, slash ? slash + 1 : png);
    if (status >= 0)
        status = om_text_append(
            &text, "\">\n<script>const p=document.getElementById('p'),a=p.getAttribute('src');\n"
                   "setInterval(()=>{const n=new Image();n.onload=()=>{p.src=n.src};"
                   "n.src=a+'?'+Date.now()},100)</script></html>\n");
    if (status >= 0) status = om_file_write(path, text.str, text.len);
    if (status >= 0) om_cli_path(path);
    om_text_done(&text);
    return status;
}

OmStatus om_cli_play_picture_begin(OmCliPlayPicture* p) {
    char extension[16];
    if (!p->name) return OM_OK;
    om_path_extension(p->name, extension, sizeof extension);
    bool is_page = strcmp(extension, "html") == 0;
    OM_CHECK(is_page || strcmp(extension, "png") == 0, OM_INVALID,
             "--picture %s: name it FILE.png, or FILE.html for a page that shows it", p->name);
    size_t len = strlen(p->name) - (is_page ? 5 : 4);
    OM_CHECK(len + 5 < sizeof p->png, OM_INVALID, "--picture: too long a path");
    snprintf(p->png, sizeof p->png, "%.*s.png", (int)len, p->name);
    om_cli_clean_beside(p->png);
    OM_TRY(om_file_check_ours(p->png, "IHDR"));  // another picture may be replaced
    return is_page ? write_page(p->name, p->png) : OM_OK;
}

OmStatus om_cli_play_picture_draw(OmCliPlayPicture* p, OmRlDrive* drive, bool is_now) {
    const double begin = om_clock_now();
    OmPicture picture = {.width = p->size, .height = p->size};
    if (!p->name || (!is_now && begin < p->next)) return OM_OK;
    OM_TRY(om_rl_drive_render(drive, &picture));
    OmStatus status = om_picture_save_png(&picture, p->png);
    om_picture_done(&picture);
    const double cost = om_clock_now() - begin;
    p->next = begin + (SHARE * cost > p->period ? SHARE * cost : p->period);
    return status;
}
