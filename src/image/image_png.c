// image_png.c: pictures and their PNG encoding; the only file that uses libpng.
//
// libpng reports errors by longjmp. Every call of it happens in encode(), behind one setjmp, where
// only libpng owns memory, so the jump cannot leak.
#include <png.h>
#include <setjmp.h>
#include <string.h>

#include "image/image_internal.h"

#define MAX_SIDE 65535

OmStatus om_picture_init(OmPicture* picture, int width, int height, int nchannel) {
    memset(picture, 0, sizeof *picture);
    OM_CHECK(width > 0 && height > 0 && width <= MAX_SIDE && height <= MAX_SIDE, OM_INVALID,
             "a picture of %d x %d pixels", width, height);
    OM_CHECK(nchannel == 1 || nchannel == 3 || nchannel == 4, OM_INVALID,
             "a picture of %d channels: 1, 3 and 4 exist", nchannel);
    picture->pixel = om_calloc((size_t)width * (size_t)height, (size_t)nchannel);
    if (!picture->pixel) return OM_NO_MEMORY;
    picture->width = width;
    picture->height = height;
    picture->nchannel = nchannel;
    return OM_OK;
}

void om_picture_done(OmPicture* picture) {
    if (!picture) return;
    om_free(picture->pixel);
    memset(picture, 0, sizeof *picture);
}

OmStatus om_picture_shrink(const OmPicture* p, int factor, OmPicture* out) {
    *out = (OmPicture){0};
    OM_CHECK(factor >= 1 && factor <= p->width && factor <= p->height, OM_INVALID,
             "a picture of %d x %d pixels cannot be shrunk by %d", p->width, p->height, factor);
    OM_TRY(om_picture_init(out, p->width / factor, p->height / factor, p->nchannel));
    const size_t n = (size_t)p->nchannel, row = n * (size_t)p->width;
    const unsigned area = (unsigned)factor * (unsigned)factor;
    unsigned char* to = out->pixel;
    for (int y = 0; y < out->height; ++y)
        for (int x = 0; x < out->width; ++x)
            for (size_t c = 0; c < n; ++c) {
                unsigned sum = 0;
                for (int j = 0; j < factor; ++j)
                    for (int i = 0; i < factor; ++i)
                        sum += p->pixel[(size_t)(y * factor + j) * row +
                                        (size_t)(x * factor + i) * n + c];
                *to++ = (unsigned char)((sum + area / 2) / area);
            }
    return OM_OK;
}

typedef struct Encoder {
    OmText* text;
    OmStatus status;    // result of appending to the text
    char message[128];  // of libpng
} Encoder;

typedef struct Raster {
    int width, height, color, depth;
    const unsigned char* row;  // the first
    size_t stride;             // bytes
} Raster;

static void on_error(png_structp png, png_const_charp message) {
    Encoder* e = png_get_error_ptr(png);
    snprintf(e->message, sizeof e->message, "%s", message);
    longjmp(png_jmpbuf(png), 1);
}

static void on_warning(png_structp png, png_const_charp message) {
    (void)png;
    om_log(OM_LOG_DEBUG, "png: %s", message);
}

static void on_write(png_structp png, png_bytep data, size_t size) {
    Encoder* e = png_get_io_ptr(png);
    e->status = om_text_append_raw(e->text, (const char*)data, size);
    if (e->status < 0) png_error(png, "out of memory");
}

static void on_flush(png_structp png) { (void)png; }

static png_voidp png_alloc(png_structp png, png_alloc_size_t size) {
    (void)png;
    return om_alloc(size, 1);
}

static void png_release(png_structp png, png_voidp ptr) {
    (void)png;
    om_free(ptr);
}

static OmStatus encode(const Raster* r, OmText* text) {
    Encoder e = {.text = text, .status = OM_OK};
    png_structp png = png_create_write_struct_2(PNG_LIBPNG_VER_STRING, &e, on_error, on_warning,
                                                NULL, png_alloc, png_release);
    if (!png) return om_error(OM_NO_MEMORY, "png: out of memory");
    png_infop info = png_create_info_struct(png);
    if (!info || setjmp(png_jmpbuf(png))) {
        png_destroy_write_struct(&png, &info);
        if (e.status < 0) return e.status;
        return om_error(OM_NO_MEMORY, "png: %s", e.message[0] ? e.message : "out of memory");
    }
    png_set_write_fn(png, &e, on_write, on_flush);
    png_set_IHDR(png, info, (png_uint_32)r->width, (png_uint_32)r->height, r->depth, r->color,
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_compression_level(png, 6);
    png_write_info(png, info);
    if (r->depth == 16 && om__is_little_endian()) png_set_swap(png);
    for (int y = 0; y < r->height; y++) png_write_row(png, r->row + (size_t)y * r->stride);
    png_write_end(png, info);
    png_destroy_write_struct(&png, &info);
    return OM_OK;
}

OmStatus om_picture_encode_png(const OmPicture* picture, OmText* text) {
    const OmPicture* p = picture;
    OM_CHECK(p->pixel && p->width > 0 && p->height > 0, OM_INVALID, "an empty picture");
    int color = p->nchannel == 1   ? PNG_COLOR_TYPE_GRAY
                : p->nchannel == 3 ? PNG_COLOR_TYPE_RGB
                                   : PNG_COLOR_TYPE_RGB_ALPHA;
    Raster r = {p->width, p->height, color, 8, p->pixel, (size_t)p->width * (size_t)p->nchannel};
    return encode(&r, text);
}

OmStatus om_picture_save_png(const OmPicture* picture, const char* path) {
    OmText text = {0};
    OmStatus status = om_picture_encode_png(picture, &text);
    if (status == OM_OK) status = om_file_write(path, text.str, text.len);
    om_text_done(&text);
    return status;
}

OmStatus om_picture_save_png16(const uint16_t* value, int width, int height, const char* path) {
    OM_CHECK(width > 0 && height > 0 && width <= MAX_SIDE && height <= MAX_SIDE, OM_INVALID,
             "a picture of %d x %d pixels", width, height);
    Raster r = {
        width, height, PNG_COLOR_TYPE_GRAY, 16, (const unsigned char*)value, 2 * (size_t)width};
    OmText text = {0};
    OmStatus status = encode(&r, &text);
    if (status == OM_OK) status = om_file_write(path, text.str, text.len);
    om_text_done(&text);
    return status;
}
