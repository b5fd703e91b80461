// view_page.c: one file with everything in it: page, scripts, the recording.
//
// page.html has the names of its parts between two @; each is replaced here. In the messages each position and stress
// of a frame becomes its difference from the part's last one, modulo its range: tissue at rest is zeros, and the
// messages, compressed (zlib) and as base64, take half the space. What comes from outside is escaped: "<" of texts in
// scripts is written as \u003c, so that no text ends its script.
#include <math.h>
#include <string.h>
#include <zlib.h>

#include "view/view_internal.h"

OmStatus om_view_add_picture(double time, const char* caption, const OmPicture* picture,
                             OmText* t) {
    OmText png = {0};
    const size_t begin = t->len;
    OmStatus status = om_picture_encode_png(picture, &png);
    if (status == OM_OK) status = om_text_append(t, "{\"time_s\":%.6g,\"caption\":", time);
    if (status == OM_OK) status = om_text_append_quoted(t, caption);
    if (status == OM_OK) status = om_text_append(t, ",\"png\":\"");
    if (status == OM_OK) status = om_text_append_base64(t, png.str, png.len);
    if (status == OM_OK) status = om_text_append(t, "\"}");
    if (status < 0) t->len = begin;
    om_text_done(&png);
    return status;
}

// One more picture of a page's list, or none after an error.
static OmStatus end_entry(OmViewPage* page, size_t begin, OmStatus status) {
    if (status < 0) page->pictures.len = begin;
    return status;
}

OmStatus om_view_page_add_picture(OmViewPage* page, double time, const char* caption,
                                  const OmPicture* picture) {
    const size_t begin = page->pictures.len;
    if (begin > 0) OM_TRY(om_text_append(&page->pictures, ",\n"));
    return end_entry(page, begin, om_view_add_picture(time, caption, picture, &page->pictures));
}

// Grey: white at the nearest depth, dark at the farthest, black where there is none.
static OmStatus draw_depth(const OmScan* scan, double* near, double* far, OmPicture* picture) {
    const int n = scan->camera.width * scan->camera.height;
    *near = INFINITY, *far = 0;
    for (int i = 0; i < n; ++i) {
        const double z = (double)scan->depth[i];
        if (!(z > 0)) continue;
        *near = fmin(*near, z), *far = fmax(*far, z);
    }
    OM_TRY(om_picture_init(picture, scan->camera.width, scan->camera.height, 1));
    const double range = *far > *near ? *far - *near : 1;
    for (int i = 0; i < n; ++i) {
        const double z = (double)scan->depth[i];
        if (z > 0) picture->pixel[i] = (unsigned char)lround(255 - 215 * (z - *near) / range);
    }
    return OM_OK;
}

static OmStatus add_camera(const OmCamera* c, OmText* t) {
    const OmVec3 p = c->pose_world_camera.p;
    const OmQuat q = c->pose_world_camera.q;
    OM_TRY(om_text_append(
        t, ",\"depth\":true,\"position\":[%.6g,%.6g,%.6g],\"quaternion\":[%.9g,%.9g,%.9g,%.9g]",
        p.x, p.y, p.z, q.x, q.y, q.z, q.w));
    return om_text_append(t, ",\"fov_y_deg\":%.6g,\"aspect\":%.6g}",
                          2 * atan(0.5 * c->height / om_camera_lens(c).fy) * 180 / OM_PI,
                          (double)c->width / c->height);
}

OmStatus om_view_add_depth(double time, const OmScan* scan, OmText* t) {
    OmPicture picture = {0};
    char caption[120];
    double near, far;
    const size_t begin = t->len;
    if (!scan->depth || !scan->has_camera) return OM_OK;
    OmStatus status = draw_depth(scan, &near, &far, &picture);
    if (status == OM_OK) {
        snprintf(caption, sizeof caption, "depth, %.0f mm (white) to %.0f mm",
                 far > 0 ? 1e3 * near : 0, 1e3 * far);
        status = om_view_add_picture(time, caption, &picture, t);
    }
    if (status == OM_OK) {
        --t->len;  // its closing brace
        status = add_camera(&scan->camera, t);
    }
    om_picture_done(&picture);
    if (status < 0) t->len = begin;
    return status;
}

OmStatus om_view_page_add_depth(OmViewPage* page, double time, const OmScan* scan) {
    const size_t begin = page->pictures.len;
    if (!scan->depth || !scan->has_camera) return OM_OK;
    if (begin > 0) OM_TRY(om_text_append(&page->pictures, ",\n"));
    return end_entry(page, begin, om_view_add_depth(time, scan, &page->pictures));
}

void om_view_page_done(OmViewPage* page) {
    om_text_done(&page->messages);
    om_text_done(&page->pictures);
    *page = (OmViewPage){0};
}

// ---- writing ------------------------------------------------------------------------------------------------

static uint32_t u32(const char* at) {
    uint32_t value;
    memcpy(&value, at, sizeof value);
    return value;
}

static size_t padded(size_t n) { return (n + 3) / 4 * 4; }

// Of a part in a frame: its box, positions and fields, as bytes of the messages.
typedef struct Shown {
    char *box, *x, *field[VIEW_NFIELD];  // field: null if there is none
    size_t nx, nvert;                    // bytes of x; of a field
} Shown;

// Replace the numbers of a part by their differences from `last`, which becomes what they were. (u16, then u8)
static void subtract(const Shown* now, char* last, char* box, bool has_last) {
    const bool is_alike = has_last && memcmp(box, now->box, VIEW_BOX) == 0;
    for (size_t i = 0; i < now->nx; i += 2) {
        uint16_t is, was;
        memcpy(&is, now->x + i, 2);
        memcpy(&was, last + i, 2);
        memcpy(last + i, &is, 2);
        if (is_alike) is = (uint16_t)(is - was);
        memcpy(now->x + i, &is, 2);
    }
    for (size_t f = 0; f < VIEW_NFIELD; ++f) {
        char* before = last + now->nx + f * now->nvert;
        for (size_t i = 0; now->field[f] && i < now->nvert; ++i) {
            const char is = now->field[f][i];
            if (is_alike) now->field[f][i] = (char)(is - before[i]);
            before[i] = is;
        }
    }
    memcpy(box, now->box, VIEW_BOX);
}

typedef struct Parts {  // as the frames so far have them
    char* last[VIEW_MAX_PART];
    char box[VIEW_MAX_PART][VIEW_BOX];
    bool has_last[VIEW_MAX_PART];
    size_t nvert[VIEW_MAX_PART];
} Parts;

// Box, positions and fields of a part. @return what follows, or null: it ends early, or has no such part
static char* find_shown(char* p, const char* end, uint32_t* part, Shown* now) {
    if (end - p < 8 + VIEW_BOX) return NULL;
    *part = u32(p);
    const size_t nvert = u32(p + 4), size = 6 * nvert;
    *now = (Shown){.box = p + 8, .x = p + 8 + VIEW_BOX, .nx = size, .nvert = nvert};
    if (*part >= VIEW_MAX_PART || (size_t)(end - now->x) < padded(size) + 4) return NULL;
    p = now->x + padded(size);
    const uint32_t fields = u32(p);
    p += 4;
    for (int f = 0; f < VIEW_NFIELD; ++f) {
        if (!(fields & 1u << f)) continue;
        if ((size_t)(end - p) < 4 + padded(nvert)) return NULL;
        now->field[f] = p + 4;
        p += 4 + padded(nvert);
    }
    return p;
}

// The frame from `at` to `end` becomes one of differences.
static OmStatus subtract_frame(char* at, char* end, Parts* parts) {
    const uint32_t kind = VIEW_DIFFERENCES;
    OM_CHECK(end - at >= VIEW_FRAME_HEAD, OM_INVALID, "a frame of %d bytes is too short",
             (int)(end - at));
    memcpy(at, &kind, sizeof kind);
    char* p = at + VIEW_FRAME_HEAD;
    for (uint32_t n = u32(p - 4); n > 0; --n) {
        Shown now;
        uint32_t k;
        p = find_shown(p, end, &k, &now);
        OM_CHECK(p, OM_INVALID, "a frame ends within a part, or has a part that cannot be");
        if (!parts->last[k]) parts->last[k] = om_calloc((6 + VIEW_NFIELD) * now.nvert + 1, 1);
        if (!parts->last[k]) return OM_NO_MEMORY;
        OM_CHECK(!parts->has_last[k] || parts->nvert[k] == now.nvert, OM_INVALID,
                 "a part has another number of vertices than before");
        subtract(&now, parts->last[k], parts->box[k], parts->has_last[k]);
        parts->has_last[k] = true;
        parts->nvert[k] = now.nvert;
    }
    return OM_OK;
}

OmStatus om__view_subtract(char* bytes, size_t size) {
    Parts parts = {0};
    OmStatus status = OM_OK;
    for (size_t at = 0; status == OM_OK && at < size;) {
        const size_t left = size - at, length = left >= 8 ? u32(bytes + at) : 0;
        OM_CHECK_DONE(length >= 4 && length <= left - 4, OM_INVALID,
                      "messages: the one at byte %zu is not whole", at);
        char* message = bytes + at + 4;
        if (u32(message) == VIEW_FRAME)
            OM_TRY_DONE(subtract_frame(message, message + length, &parts));
        at += 4 + length;
    }
done:
    for (int k = 0; k < VIEW_MAX_PART; ++k) om_free(parts.last[k]);
    return status;
}

static OmStatus add_messages(const OmViewPage* page, OmText* out) {
    const OmText* messages = &page->messages;
    uLongf size = compressBound(messages->len);
    char *plain = NULL, *packed = NULL;
    OmStatus status = OM_OK;
    OM_ALLOC_DONE(plain, messages->len + 1);
    OM_ALLOC_DONE(packed, size + 1);
    if (messages->len > 0) memcpy(plain, messages->str, messages->len);
    OM_TRY_DONE(om__view_subtract(plain, page->messages.len));
    OM_CHECK_DONE(compress2((Bytef*)packed, &size, (const Bytef*)plain, messages->len, 6) == Z_OK,
                  OM_NO_MEMORY, "out of memory to compress a recording");
    status = om_text_append_base64(out, packed, size);
done:
    om_free(plain);
    om_free(packed);
    return status;
}

// JSON inside of a script.
static OmStatus add_json(const char* text, size_t size, OmText* out) {
    size_t begin = 0;
    for (size_t i = 0; i <= size; ++i) {
        if (i < size && text[i] != '<') continue;
        OM_TRY(om_text_append_raw(out, text + begin, i - begin));
        if (i < size) OM_TRY(om_text_append(out, "\\u003c"));
        begin = i + 1;
    }
    return OM_OK;
}

static OmStatus add_asset(ViewAssetName name, OmText* out) {
    const ViewAsset a = om__view_asset(name);
    return om_text_append_raw(out, a.data, a.size);
}

// A tag around files: the page of a recording has them inside.
static OmStatus add_tag(const char* tag, const ViewAssetName* name, int n, OmText* out) {
    for (int k = 0; k < n; ++k) {
        OM_TRY(om_text_append(out, "<%s>\n", tag));
        OM_TRY(add_asset(name[k], out));
        OM_TRY(om_text_append(out, "</%s>\n", tag));
    }
    return OM_OK;
}

static bool is_field(const char* name, size_t len, const char* field) {
    return strlen(field) == len && memcmp(name, field, len) == 0;
}

// Of a page without messages, which a server feeds.
static OmStatus add_live_field(const char* name, size_t len, OmText* out) {
    if (is_field(name, len, "style"))
        return om_text_append(out, "<link rel=\"stylesheet\" href=\"page.css\">");
    if (is_field(name, len, "scripts"))
        return om_text_append(
            out, "<script src=\"three_bundle.js\"></script>\n<script src=\"page.js\"></script>");
    return OM_OK;
}

static OmStatus add_field(const OmViewPage* page, const char* name, size_t len, OmText* out) {
    static const ViewAssetName style[] = {VIEW_CSS}, script[] = {VIEW_THREE, VIEW_JS};
    const char* story = page->story ? page->story : "";
    if (is_field(name, len, "title"))
        return om_text_append_html(out, page->title ? page->title : "");
    if (is_field(name, len, "back")) return om_text_append_html(out, page->back ? page->back : "");
    if (!page->messages.str) return add_live_field(name, len, out);
    if (is_field(name, len, "style")) return add_tag("style", style, 1, out);
    if (is_field(name, len, "scripts")) return add_tag("script", script, 2, out);
    if (is_field(name, len, "messages")) return add_messages(page, out);
    if (is_field(name, len, "story")) return add_json(story, strlen(story), out);
    if (is_field(name, len, "pictures"))
        return add_json(page->pictures.str ? page->pictures.str : "", page->pictures.len, out);
    return om_error(OM_INVALID, "page.html: no field has this name");
}

static OmStatus fill(const OmViewPage* page, OmText* out) {
    const ViewAsset html = om__view_asset(VIEW_HTML);
    const char *at = html.data, *end = html.data + html.size;
    while (at < end) {
        const char* field = memchr(at, '@', (size_t)(end - at));
        OM_TRY(om_text_append_raw(out, at, (size_t)((field ? field : end) - at)));
        if (!field) break;
        const char* close = memchr(field + 1, '@', (size_t)(end - field - 1));
        OM_CHECK(close, OM_INVALID, "page.html: a field has no end");
        OM_TRY(add_field(page, field + 1, (size_t)(close - field - 1), out));
        at = close + 1;
    }
    return OM_OK;
}

OmStatus om__view_live_page(const char* title, OmText* html) {
    const OmViewPage page = {.title = title};
    return fill(&page, html);
}

OmStatus om_view_page_save(const OmViewPage* page, const char* path) {
    OmText out = {0};
    OmStatus status = fill(page, &out);
    if (status == OM_OK) status = om_file_write(path, out.str, out.len);
    om_text_done(&out);
    return status;
}
